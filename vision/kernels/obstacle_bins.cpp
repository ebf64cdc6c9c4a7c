// Level directions, readings in the band, nearest of each bin.
#include "vision/kernels/obstacle_bins.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr float kPi = 3.14159265f;
constexpr float kBin_rad = 2.f * kPi / static_cast<float>(kObstacleBins);

struct BinView {
  float nearest_m = 0;   ///< 0: nothing in the band
  bool through = false;  ///< some ray is free in the band as far as the greatest distance
  bool doubt = false;    ///< a ray that stays in the band met no depth
};
using View = std::array<BinView, kObstacleBins>;

/// Bins that a cell shows: those whose middle lies within half the spacing of cells, the nearest one always.
template <class Visit>
void for_bins(float azimuth_rad, float spacing_rad, Visit visit) noexcept {
  const float cosine = std::max(0.2f, std::cos(azimuth_rad));  // cells stand closer towards the picture's sides
  const float at = azimuth_rad / kBin_rad, half = 0.5f * spacing_rad * cosine * cosine / kBin_rad;
  const int own = static_cast<int>(std::lround(at));
  const int reach = std::clamp(static_cast<int>(half) + 1, 1, 6);
  for (int bin = own - reach; bin <= own + reach; ++bin)
    if (bin == own || std::abs(static_cast<float>(bin) - at) <= half)
      visit(static_cast<std::size_t>((bin % kObstacleBins + kObstacleBins) % kObstacleBins));
}

/// How far a ray of this slope (down positive) runs within the band.
float in_band_to_m(const MapParams& map, const Vec3& level) noexcept {
  const float slope = level.z() / std::max(1e-3f, std::hypot(level.x(), level.y()));
  return (slope > 0.f ? map.below_m : map.above_m) / std::max(1e-3f, std::abs(slope));
}

float spacing_of(const CameraGeometry& camera, const FlowField& field) noexcept {
  return static_cast<float>(camera.intrinsics.width_px) / camera.intrinsics.fx_px / static_cast<float>(field.columns);
}

void see(const ObstacleBinsParams& p, const LevelFlow& flow, float spacing_rad, View& view) noexcept {
  std::array<float, kMaxReadings> range{};
  for (std::size_t k = 0; k < flow.view().size(); ++k) range[k] = flow.cells[k].depth_m;
  MapParams map = p.map;
  map.max_range_m = p.greatest_m;
  std::array<MapReading, kMaxReadings> readings;
  const auto n = static_cast<std::size_t>(map_readings(map, flow, {range.data(), flow.view().size()}, readings));
  for (const MapReading& r : std::span(readings.data(), n))
    for_bins(r.azimuth_rad, spacing_rad, [&](std::size_t bin) noexcept {
      BinView& v = view[bin];
      if (r.in_band) v.nearest_m = v.nearest_m > 0.f ? std::min(v.nearest_m, r.range_m) : r.range_m;
      v.through = v.through || (!r.in_band && r.through_m >= p.greatest_m);
    });
  for (const LevelCell& cell : flow.view())
    if (!(cell.depth_m > 0.f) && in_band_to_m(p.map, cell.first) >= p.greatest_m)
      for_bins(cell.azimuth_rad, spacing_rad, [&](std::size_t bin) noexcept { view[bin].doubt = true; });
}

std::uint16_t centimetres(float m) noexcept {
  return static_cast<std::uint16_t>(std::clamp(std::lround(100.f * m), 0l, 60'000l));
}

}  // namespace

ObstacleBins obstacle_bins(const ObstacleBinsParams& params, const FlowMessage& message) noexcept {
  ObstacleBins out;
  out.distance_cm.fill(kBinUnknown);
  out.exposed_at_ns = message.first_exposed_at_ns;
  LevelFlow flow;
  level_flow(params.camera, &message, FlowKind::kSeen, flow);
  if (!flow.valid) return out;
  View view{};
  see(params, flow, spacing_of(params.camera, message.seen), view);
  const std::uint16_t greatest_cm = centimetres(params.greatest_m);
  for (std::size_t i = 0; i < view.size(); ++i) {
    const BinView& v = view[i];
    if (v.nearest_m > 0.f)
      out.distance_cm[i] = std::min(centimetres(std::max(v.nearest_m, params.least_m)), greatest_cm);
    else if (v.through && !v.doubt)
      out.distance_cm[i] = static_cast<std::uint16_t>(greatest_cm + 1);
    else
      continue;
    ++out.seen;
  }
  for (const LevelCell& cell : flow.view()) out.valid = out.valid || cell.depth_m > 0.f;
  return out;
}

}  // namespace wasp::vision
