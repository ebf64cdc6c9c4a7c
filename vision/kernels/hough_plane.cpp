// (6.39) for a point, (6.28)-(6.30) for a plane, a hash slot for a cell.
#include "vision/kernels/hough_plane.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "vision/kernels/camera_model.h"

namespace wasp::vision {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

int bin_of(float x, float low, float high, int bins) noexcept {
  return std::clamp(static_cast<int>((x - low) / (high - low) * static_cast<float>(bins)), 0, bins - 1);
}

float centre_of(std::uint32_t bin, float low, float high, int bins) noexcept {
  return low + (static_cast<float>(bin) + 0.5f) * (high - low) / static_cast<float>(bins);
}

HoughParams within_limits(HoughParams p) noexcept {
  p.bins = std::clamp(p.bins, 8, 255);
  p.accept_votes = std::clamp(p.accept_votes, 2, 1000);
  p.max_draws = std::clamp(p.max_draws, 1, kHoughTuples);
  return p;
}

}  // namespace

RandomizedHough::RandomizedHough(const HoughParams& params, const Intrinsics& intrinsics) noexcept
    : params_(within_limits(params)),
      intrinsics_(intrinsics),
      usable_(usable(intrinsics) && std::min(intrinsics.width_px, intrinsics.height_px) >= kMinImageSide &&
              std::max(intrinsics.width_px, intrinsics.height_px) <= 65535 && params.max_rho_m > 0.f &&
              std::isfinite(params.max_rho_m + params.max_distance_m)) {
  draw_tuples(params_.sampling, intrinsics_.width_px, intrinsics_.height_px, tuples_);
}

bool RandomizedHough::point(const DepthView& depth, int u, int v, Vec3& out) const noexcept {
  const int mm = depth.row(v)[u];
  const float z = 0.001f * static_cast<float>(mm);
  const float x = (static_cast<float>(u) - intrinsics_.cx_px) * z / intrinsics_.fx_px;
  const float y = (static_cast<float>(v) - intrinsics_.cy_px) * z / intrinsics_.fy_px;
  out = {x, y, z};
  return mm != 0 && mm != 65535 && z >= params_.range.min_m && z <= params_.range.max_m;
}

bool RandomizedHough::span(const DepthView& depth, const PixelTuple& t, Vec3& normal, float& rho_m) const noexcept {
  Vec3 p1, p2, p3;
  if (!point(depth, t.u_px[0], t.v_px[0], p1) || !point(depth, t.u_px[1], t.v_px[1], p2) ||
      !point(depth, t.u_px[2], t.v_px[2], p3))
    return false;
  const float far = params_.max_distance_m;
  if (params_.sampling.sampler == HoughSampler::kLocalCartesian &&
      ((p1 - p2).norm() > far || (p2 - p3).norm() > far || (p3 - p1).norm() > far))
    return false;
  const Vec3 cross = (p3 - p2).cross(p1 - p2);
  const float area = cross.norm();
  if (!(area > 1e-4f * p1.squaredNorm())) return false;  // three points in a line
  normal = cross / area;
  rho_m = normal.dot(p1);
  if (rho_m < 0.f) normal = -normal, rho_m = -rho_m;
  return rho_m < params_.max_rho_m;
}

std::uint32_t RandomizedHough::key_of(const Vec3& n, float rho_m) const noexcept {
  const int theta = bin_of(std::atan2(n.y(), n.x()), -kPi, kPi, params_.bins);
  const int phi = bin_of(std::acos(std::clamp(n.z(), -1.f, 1.f)), 0.f, kPi, params_.bins);
  const int rho = bin_of(rho_m, 0.f, params_.max_rho_m, params_.bins);
  return static_cast<std::uint32_t>(theta) << 16 | static_cast<std::uint32_t>(phi) << 8 |
         static_cast<std::uint32_t>(rho);
}

RandomizedHough::Cell& RandomizedHough::vote(std::uint32_t key, const Vec3& normal, float rho_m) noexcept {
  std::uint32_t slot = (key * 2654435761u) % kSlots;
  for (std::uint32_t probe = 0; probe < kSlots && cells_[slot].key != kEmpty && cells_[slot].key != key; ++probe)
    slot = (slot + 1) % kSlots;
  Cell& cell = cells_[slot];
  cell.key = key;
  ++cell.votes;
  cell.normal_sum += normal;
  cell.rho_sum += rho_m;
  return cell;
}

HoughPlane RandomizedHough::answer(const Cell& cell) const noexcept {
  HoughPlane out;
  out.valid = true;
  out.votes = static_cast<int>(cell.votes);
  if (params_.mean_of_cell) {
    out.normal_cam = -cell.normal_sum.normalized();
    out.height_m = cell.rho_sum / static_cast<float>(cell.votes);
    return out;
  }
  const float theta = centre_of(cell.key >> 16, -kPi, kPi, params_.bins);
  const float phi = centre_of((cell.key >> 8) & 0xffu, 0.f, kPi, params_.bins);
  out.normal_cam = -Vec3(std::cos(theta) * std::sin(phi), std::sin(theta) * std::sin(phi), std::cos(phi));
  out.height_m = centre_of(cell.key & 0xffu, 0.f, params_.max_rho_m, params_.bins);
  return out;
}

HoughPlane RandomizedHough::detect(const DepthView& depth) noexcept {
  HoughPlane out;
  if (!usable_ || !depth.valid() || depth.width_px != intrinsics_.width_px || depth.height_px != intrinsics_.height_px)
    return out;
  cells_.fill({kEmpty, 0, Vec3::Zero(), 0.f});
  int planes = 0;
  for (int draw = 0; draw < params_.max_draws; ++draw) {
    Vec3 normal;
    float rho_m = 0.f;
    if (!span(depth, tuples_[static_cast<std::size_t>(draw)], normal, rho_m)) continue;
    ++planes;
    const Cell& cell = vote(key_of(normal, rho_m), normal, rho_m);
    const bool reached = cell.votes >= static_cast<std::uint32_t>(params_.accept_votes);
    if (reached) out = answer(cell);
    out.draws = draw + 1;
    out.planes = planes;
    if (reached) break;
  }
  return out;
}

}  // namespace wasp::vision
