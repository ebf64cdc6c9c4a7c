#include "vision/kernels/side_balance.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr int kBins = 6;
constexpr int kMaxPerBin = 64;

struct Bin {
  std::array<float, kMaxPerBin> value{};
  int count = 0;
};
using Side = std::array<Bin, kBins>;

/// Median, the mean of the middle two for even counts: an upper median would favour the side with fewer cells.
float middle(Bin& bin) noexcept {
  const auto first = bin.value.begin(), half = first + bin.count / 2;
  std::nth_element(first, half, first + bin.count);
  return bin.count % 2 != 0 ? *half : 0.5f * (*half + *std::max_element(first, half));
}

bool sane(const SideParams& p) noexcept {
  return p.least_azimuth_rad > 0.01f && p.greatest_azimuth_rad > p.least_azimuth_rad && p.greatest_azimuth_rad <= 3.f &&
         p.greatest_elevation_rad > 0.f && p.min_cells >= 1;
}

void sort_into_bins(const SideParams& p, const LevelFlow& flow, Side& left, Side& right) noexcept {
  const float width = (p.greatest_azimuth_rad - p.least_azimuth_rad) / static_cast<float>(kBins);
  for (const LevelCell& cell : flow.view()) {
    const float off = std::abs(cell.azimuth_rad);
    if (!cell.moved || off < p.least_azimuth_rad || off >= p.greatest_azimuth_rad ||
        !(std::abs(cell.elevation_rad) <= p.greatest_elevation_rad))
      continue;
    const auto k =
        static_cast<std::size_t>(std::clamp(static_cast<int>((off - p.least_azimuth_rad) / width), 0, kBins - 1));
    Bin& bin = cell.azimuth_rad < 0.f ? left[k] : right[k];
    if (bin.count == kMaxPerBin) continue;
    const float outwards = cell.azimuth_rad < 0.f ? -cell.azimuth_rate_radps : cell.azimuth_rate_radps;
    bin.value[static_cast<std::size_t>(bin.count++)] =
        p.measure == SideMeasure::kNearness ? outwards / std::sin(off) : outwards;
  }
}

}  // namespace

SideBalance side_balance(const SideParams& params, const LevelFlow& flow) noexcept {
  SideBalance out;
  if (!flow.valid || !sane(params)) return out;
  Side left, right;
  sort_into_bins(params, flow, left, right);
  const float width = (params.greatest_azimuth_rad - params.least_azimuth_rad) / static_cast<float>(kBins);
  float weights = 0.f;
  for (std::size_t k = 0; k < kBins; ++k) {
    if (left[k].count == 0 || right[k].count == 0) continue;
    const float azimuth = params.least_azimuth_rad + (static_cast<float>(k) + 0.5f) * width;
    const auto weight = static_cast<float>(std::min(left[k].count, right[k].count));
    out.left += weight * middle(left[k]);
    out.right += weight * middle(right[k]);
    out.mean_cosine += weight * std::cos(azimuth);
    out.mean_sine += weight * std::sin(azimuth);
    out.cells_left += left[k].count;
    out.cells_right += right[k].count;
    weights += weight;
  }
  if (std::min(out.cells_left, out.cells_right) < params.min_cells) return out;
  out.left /= weights;
  out.right /= weights;
  out.mean_cosine /= weights;
  out.mean_sine /= weights;
  out.valid = std::isfinite(out.left + out.right);
  return out;
}

}  // namespace wasp::vision
