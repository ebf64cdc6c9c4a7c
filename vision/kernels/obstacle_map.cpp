#include "vision/kernels/obstacle_map.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr float kPi = 3.14159265f;
constexpr float kSector_rad = 2.f * kPi / static_cast<float>(kSectors);
constexpr float kSameThing_m = 0.5f;  // readings and memories this close in range are of one thing
constexpr float kSeenThrough_m = 0.3f;

/// Speed at which the point closes in along the heading, from where its direction goes: P - w dt x lies along `second`.
float closing_speed(const LevelCell& cell, float range_m, float interval_s, float& weight) noexcept {
  const Vec3 P = cell.first * range_m, ahead = Vec3::UnitX();
  const Vec3 P_across = P - cell.second * cell.second.dot(P);
  const Vec3 ahead_across = ahead - cell.second * cell.second.x();
  weight = ahead_across.squaredNorm();  // sin^2 of the angle from the heading
  return weight > 1e-4f ? ahead_across.dot(P_across) / (weight * interval_s) : 0.f;
}

struct SectorView {
  bool seen = false, hit = false, blocked = false;  // blocked: a neighbour's reading counts too
  MapReading nearest;
  float through_m = 0;  ///< how far the view is free: to the nearest thing in the band, else as far as any ray shows
  float closing = 0, weight = 0;
};
using View = std::array<SectorView, kSectors>;

/// Each reading shows its own sector and those less than half the spacing of readings off.
template <class Visit>
void for_sectors(float azimuth_rad, float spacing_rad, Visit visit) WASP_REALTIME {
  const int reach = std::clamp(static_cast<int>(0.5f * spacing_rad / kSector_rad + 0.5f), 0, 3);
  const int own = sector_of(azimuth_rad);
  for (int off = -reach; off <= reach; ++off)
    visit(static_cast<std::size_t>((own + off + kSectors) % kSectors), off == 0);
}

void look(std::span<const MapReading> readings, float spacing_rad, View& view) noexcept {
  for (const MapReading& r : readings) {
    const auto show = [&view, &r](std::size_t k, bool own) WASP_REALTIME {
      SectorView& v = view[k];
      v.seen = true;
      if (r.in_band) v.through_m = v.blocked ? std::min(v.through_m, r.range_m) : r.range_m;
      if (!r.in_band && !v.blocked) v.through_m = std::max(v.through_m, r.through_m);
      v.blocked = v.blocked || r.in_band;
      if (!r.in_band) return;
      if (own && (!v.hit || r.range_m < v.nearest.range_m)) v.nearest = r, v.hit = true;
    };
    for_sectors(r.azimuth_rad, spacing_rad, show);
  }
  for (const MapReading& r : readings) {  // motion: all of the thing that is nearest
    SectorView& v = view[static_cast<std::size_t>(sector_of(r.azimuth_rad))];
    if (!r.in_band || !v.hit || !(r.closing_weight > 0.f) || r.range_m > v.nearest.range_m + kSameThing_m) continue;
    v.closing += r.closing_weight * r.closing_mps;
    v.weight += r.closing_weight;
  }
}

/// Own motion of a thing along the heading; towards the vehicle is negative.
float own_motion(const MapParams& p, const SectorView& v, float speed_mps) noexcept {
  if (!(v.weight > 0.05f)) return 0.f;
  const float towards = v.closing / v.weight - speed_mps;
  return towards < p.least_motion_mps ? 0.f : -std::min(towards, p.greatest_motion_mps);
}

}  // namespace

int sector_of(float azimuth_rad) noexcept {
  const int k = static_cast<int>(std::floor((azimuth_rad + kPi) / kSector_rad));
  return std::clamp(k, 0, kSectors - 1);
}

int map_readings(const MapParams& params, const LevelFlow& flow, std::span<const float> range_m,
                 std::span<MapReading> out) noexcept {
  std::size_t n = 0;
  const auto cells = flow.view();
  for (std::size_t k = 0; k < std::min(cells.size(), range_m.size()) && n < out.size(); ++k) {
    const LevelCell& cell = cells[k];
    if (!(range_m[k] > 0.f) || !std::isfinite(range_m[k])) continue;
    MapReading r;
    r.azimuth_rad = cell.azimuth_rad;
    r.x_m = cell.first.x() * range_m[k], r.y_m = cell.first.y() * range_m[k];
    r.range_m = std::hypot(r.x_m, r.y_m);
    const float down_m = cell.first.z() * range_m[k];
    r.in_band = down_m > -params.above_m && down_m < params.below_m && r.range_m < params.max_range_m;
    const float slope = cell.first.z() / std::max(1e-3f, std::hypot(cell.first.x(), cell.first.y()));
    const float leaves_m = (slope > 0.f ? params.below_m : params.above_m) / std::max(1e-3f, std::abs(slope));
    r.through_m = std::min(r.range_m, leaves_m);
    if (cell.moved && cell.depth_m > 0.f)
      r.closing_mps = closing_speed(cell, range_m[k], flow.interval_s, r.closing_weight);
    out[n++] = r;
  }
  return static_cast<int>(n);
}

void drop_lone(float spacing_rad, std::span<MapReading> readings) noexcept {
  std::array<bool, kMaxReadings> lone{};
  const std::size_t n = std::min(readings.size(), lone.size());
  for (std::size_t i = 0; i < n; ++i) {
    const MapReading& a = readings[i];
    bool company = false;
    for (std::size_t j = 0; j < n && !company; ++j) {
      const MapReading& b = readings[j];
      company = i != j && std::abs(a.azimuth_rad - b.azimuth_rad) < 1.5f * spacing_rad &&
                std::abs(a.range_m - b.range_m) < 0.15f + 0.15f * a.range_m;
    }
    lone[i] = !company;
  }
  for (std::size_t i = 0; i < n; ++i)
    if (lone[i]) readings[i].in_band = false, readings[i].through_m = 0.f;
}

void advance(const MapParams& params, const VehicleStep& step, ObstacleMap& map) noexcept {
  const float c = std::cos(step.turn_rad), s = std::sin(step.turn_rad);
  const bool finite = std::isfinite(step.dt_s + step.forward_m + step.right_m + c + s);
  const ObstacleMap old = map;
  map = {};
  if (!finite) return;
  for (const MapPoint& p : old.sector) {
    MapPoint q = p;
    const float x = p.x_m + p.vx_mps * step.dt_s - step.forward_m, y = p.y_m + p.vy_mps * step.dt_s - step.right_m;
    q.x_m = c * x + s * y, q.y_m = c * y - s * x;
    q.vx_mps = c * p.vx_mps + s * p.vy_mps, q.vy_mps = c * p.vy_mps - s * p.vx_mps;
    q.unseen_s = p.unseen_s + step.dt_s;
    const float range_m = std::hypot(q.x_m, q.y_m);
    if (!p.known || !(q.unseen_s <= params.memory_s) || !(range_m <= params.max_range_m)) continue;
    MapPoint& there = map.sector[static_cast<std::size_t>(sector_of(std::atan2(q.y_m, q.x_m)))];
    if (!there.known || range_m < std::hypot(there.x_m, there.y_m)) there = q;
  }
}

void observe(const MapParams& params, std::span<const MapReading> readings, float spacing_rad, float speed_mps,
             ObstacleMap& map) noexcept {
  View view;
  look(readings, spacing_rad, view);
  const ObstacleMap before = map;
  for (std::size_t k = 0; k < kSectors; ++k) {
    MapPoint& p = map.sector[k];
    const SectorView& v = view[k];
    if (p.known && v.seen && std::hypot(p.x_m, p.y_m) < v.through_m - kSeenThrough_m) p = {};
    if (!v.hit) continue;
    const float range_m = v.nearest.range_m;
    float motion_mps = own_motion(params, v, speed_mps);
    for (int off = -1; off <= 1; ++off) {  // the same thing a moment ago: half its motion then
      const MapPoint& q = before.sector[(k + static_cast<std::size_t>(off + kSectors)) % kSectors];
      if (!q.known || std::abs(std::hypot(q.x_m, q.y_m) - range_m) > kSameThing_m) continue;
      motion_mps = 0.8f * q.vx_mps + 0.2f * motion_mps;
      break;
    }
    p = {v.nearest.x_m, v.nearest.y_m, motion_mps, 0.f, 0.f, true};
  }
}

}  // namespace wasp::vision
