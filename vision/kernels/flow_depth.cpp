// A point at R in the first frame's camera axes is at R - t in them once the camera has moved by t. With e and e' the
// de-rotated rays before and after, R = X (e, 1): (X - t_z) e' = X e - t_xy, so X (e' - e) = t_z e' - t_xy, exactly.
#include "vision/kernels/flow_depth.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr int kTurnRounds = 4;

struct Rays {
  Ray first, second;
  bool valid = false;
};
using RayGrid = std::array<Rays, FlowField::kMaxColumns * FlowField::kMaxRows>;

bool ray_of(const Lens& lens, Pixel pixel, Ray& ray) noexcept {
  Vec3 d;
  if (!direction_of(lens, pixel, d) || !(d.z() > 0.05f)) return false;
  ray = {d.x() / d.z(), d.y() / d.z()};
  return true;
}

bool rays_of(const Lens& lens, const FlowCell& cell, Rays& out) noexcept {
  return out.valid = cell.valid != 0 && ray_of(lens, {cell.x_px, cell.y_px}, out.first) &&
                     ray_of(lens, {cell.x_px + cell.u_px, cell.y_px + cell.v_px}, out.second);
}

/// Unit normal of the line through the focus on which the second ray must lie.
Ray across_line(const Rays& rays, const Vec3& t) noexcept {
  const float lu = t.z() * rays.second.x - t.x(), lv = t.z() * rays.second.y - t.y();
  const float length = std::sqrt(lu * lu + lv * lv);
  return length > 0.f ? Ray{lv / length, -lu / length} : Ray{};
}

/// Rotation, beyond the one given and `so_far`, that best explains the flow across the lines. Robust, one round.
Vec3 remaining_turn(const FlowDepthParams& p, const Intrinsics& k, const RayGrid& rays, int count, const Vec3& t,
                    const Vec3& so_far) noexcept {
  const float noise = p.flow_sigma_px * p.flow_sigma_px / (k.fx_px * k.fy_px);
  const float prior = noise / (p.turn_sigma_rad * p.turn_sigma_rad);
  Mat3 normal = Mat3::Identity() * prior;
  Vec3 right = -prior * so_far;
  for (int i = 0; i < count; ++i) {
    const Rays& r = rays[static_cast<std::size_t>(i)];
    if (!r.valid) continue;
    const Ray n = across_line(r, t);
    const float off = n.x * (r.second.x - r.first.x) + n.y * (r.second.y - r.first.y);
    Vec3 slope;  // of `off` with the turn
    for (int axis = 0; axis < 3; ++axis) {
      const auto flow = rotational_flow(r.first, Vec3::Unit(axis));
      slope[axis] = n.x * flow[0] + n.y * flow[1];
    }
    const float weight = 1.f / (1.f + off * off / (9.f * noise));
    normal += weight * slope * slope.transpose();
    right += weight * off * slope;
  }
  const Vec3 turn = normal.ldlt().solve(right);
  return turn.allFinite() && turn.norm() < 0.2f ? turn : Vec3(Vec3::Zero());
}

void turn_back(const Vec3& turn, int count, RayGrid& rays) noexcept {
  const float angle = turn.norm();
  if (!(angle > 0.f)) return;
  const Mat3 R = Eigen::AngleAxisf(angle, turn / angle).toRotationMatrix();
  for (int i = 0; i < count; ++i) {
    Rays& r = rays[static_cast<std::size_t>(i)];
    const Vec3 d = R * Vec3(r.second.x, r.second.y, 1.f);
    r.valid = r.valid && d.z() > 0.05f;
    if (r.valid) r.second = {d.x() / d.z(), d.y() / d.z()};
  }
}

bool usable(const FlowDepthParams& p, const Lens& lens, const FlowField& flow, const CameraStep& camera) noexcept {
  const float moved = camera.velocity_cam_m_s.norm() * camera.interval_s;
  return vision::usable(lens.intrinsics) && camera.interval_s > 0.f && std::isfinite(moved) && moved > 0.f &&
         camera.rate_cam_rad_s.allFinite() && p.flow_sigma_px > 0.f && flow.columns > 0 && flow.rows > 0 &&
         flow.columns <= FlowField::kMaxColumns && flow.rows <= FlowField::kMaxRows;
}

DepthCell depth_of(const FlowDepthParams& p, const Intrinsics& k, const Rays& rays, const Vec3& t) noexcept {
  const float su = p.flow_sigma_px / k.fx_px, sv = p.flow_sigma_px / k.fy_px;
  const float mu = rays.second.x - rays.first.x, mv = rays.second.y - rays.first.y;    // motion of the ray
  const float lu = t.z() * rays.second.x - t.x(), lv = t.z() * rays.second.y - t.y();  // X times it
  const float length = std::sqrt(lu * lu + lv * lv);
  const float sigma = std::sqrt(su * su * lu * lu + sv * sv * lv * lv) / length;  // of motion along the line
  const float along = (mu * lu + mv * lv) / length, off = (mu * lv - mv * lu) / length;
  DepthCell cell;
  if (!(length > 0.f) || !(sigma <= p.max_relative_sigma * along) || !(std::abs(off) <= p.max_off_line_sigmas * sigma))
    return cell;
  cell.depth_m = length / along;
  cell.sigma_m = cell.depth_m * sigma / along;
  cell.valid = cell.depth_m >= p.min_depth_m && cell.depth_m <= p.max_depth_m;
  return cell;
}

/// numerator / denominator, unless the denominator is too uncertain or the depth out of range.
bool quotient(const FlowDepthParams& p, float numerator, float denominator, float sigma, float& depth_m) noexcept {
  if (!(sigma <= p.max_relative_sigma * std::abs(denominator))) return false;
  depth_m = numerator / denominator;
  return depth_m >= p.min_depth_m && depth_m <= p.max_depth_m;
}

}  // namespace

void flow_depth(const FlowDepthParams& params, const Lens& lens, const FlowField& flow, const CameraStep& camera,
                DepthGrid& out) noexcept {
  out = {};
  if (!usable(params, lens, flow, camera)) return;
  FlowField still;
  derotate(lens, flow, camera.rate_cam_rad_s, camera.interval_s, still);
  const Vec3 moved = camera.velocity_cam_m_s * camera.interval_s;
  const auto count = static_cast<std::size_t>(flow.count());
  RayGrid rays;
  for (std::size_t i = 0; i < count; ++i) rays_of(lens, still.cells[i], rays[i]);
  Vec3 correction = Vec3::Zero();
  for (int round = 0; round < (params.turn_sigma_rad > 0.f ? kTurnRounds : 0); ++round) {
    const Vec3 turn = remaining_turn(params, lens.intrinsics, rays, flow.count(), moved, correction);
    turn_back(turn, flow.count(), rays);
    correction += turn;
  }
  for (std::size_t i = 0; i < count; ++i)
    if (rays[i].valid) out[i] = depth_of(params, lens.intrinsics, rays[i], moved);
}

void flow_depth_printed(const FlowDepthParams& params, const Lens& lens, const FlowField& flow,
                        const CameraStep& camera, PrintedDepthGrid& out) noexcept {
  out = {};
  if (!usable(params, lens, flow, camera)) return;
  const Vec3& v = camera.velocity_cam_m_s;
  const Intrinsics& k = lens.intrinsics;
  const float su = params.flow_sigma_px / (k.fx_px * camera.interval_s);
  const float sv = params.flow_sigma_px / (k.fy_px * camera.interval_s);
  for (std::size_t i = 0; i < static_cast<std::size_t>(flow.count()); ++i) {
    Rays rays;
    if (!rays_of(lens, flow.cells[i], rays)) continue;
    const Ray e = rays.first;
    const auto turning = rotational_flow(e, camera.rate_cam_rad_s);
    const float u = (rays.second.x - e.x) / camera.interval_s, w = (rays.second.y - e.y) / camera.interval_s;
    out[i].valid_u = quotient(params, -v.x() + v.z() * e.x, u - turning[0], su, out[i].from_u_m);
    out[i].valid_v = quotient(params, -v.y() + v.z() * e.y, w - turning[1], sv, out[i].from_v_m);
  }
}

}  // namespace wasp::vision
