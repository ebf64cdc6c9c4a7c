#include "vision/kernels/flow_view.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/camera_model.h"
#include "vision/kernels/derotate.h"

namespace wasp::vision {
namespace {

constexpr float kMinForward = 0.05f, kLargestAngle_rad = 1.4f;
constexpr DurationNs kLongestInterval = kSecond;

bool has_shape(const FlowField& flow) noexcept {
  return flow.columns > 0 && flow.rows > 0 && flow.columns <= FlowField::kMaxColumns &&
         flow.rows <= FlowField::kMaxRows;
}

bool view_cell(const Lens& lens, const FlowView& view, float least_cosine, FlowCell& cell) noexcept {
  Vec3 first, second;
  if (!direction_of(lens, {cell.x_px, cell.y_px}, first) ||
      !direction_of(lens, {cell.x_px + cell.u_px, cell.y_px + cell.v_px}, second))
    return false;
  const Vec3 a = view.R_view_first * first, b = view.R_view_second * second;  // unit
  if (!(a.z() >= least_cosine) || !(b.z() > kMinForward)) return false;
  cell.x_px = view.focal_px * a.x() / a.z(), cell.y_px = view.focal_px * a.y() / a.z();
  cell.u_px = view.focal_px * b.x() / b.z() - cell.x_px, cell.v_px = view.focal_px * b.y() / b.z() - cell.y_px;
  return std::isfinite(cell.u_px + cell.v_px);
}

}  // namespace

void view_flow(const Lens& lens, const FlowField& in, const FlowView& view, FlowField& out) noexcept {
  out = in;
  const bool good = has_shape(in) && usable(lens.intrinsics) && view.R_view_first.allFinite() &&
                    view.R_view_second.allFinite() && view.focal_px > 0.f;
  const float least_cosine = std::cos(std::clamp(view.max_angle_rad, 0.f, kLargestAngle_rad));
  for (FlowCell& cell : out.cells)
    if (!good || (cell.valid != 0 && !view_cell(lens, view, least_cosine, cell))) cell.valid = 0;
}

Mat3 R_level_body_of(const std::array<float, 4>& q) noexcept {
  const Mat3 R_ned_body = Quat(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  const float yaw_rad = std::atan2(R_ned_body(1, 0), R_ned_body(0, 0));
  return Eigen::AngleAxisf(-yaw_rad, Vec3::UnitZ()).toRotationMatrix() * R_ned_body;
}

FlowFrames frames_of(const FlowMessage& message, const Mat3& R_body_cam) noexcept {
  FlowFrames f;
  const TimeNs first = message.first_exposed_at_ns, second = message.exposed_at_ns;
  if (!has_shape(message.seen) || !has_shape(message.still) || message.seen.columns != message.still.columns ||
      message.seen.rows != message.still.rows || second <= first || second / 2 - first / 2 > kLongestInterval / 2)
    return f;  // halves cannot overflow
  f.interval_s = message.interval_s();
  f.valid = f.interval_s > 0.f;
  if (message.derotated == 0) return f;
  const auto& r = message.R_second_first;
  Mat3 R_second_first;
  R_second_first << r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8];
  f.valid = f.valid && attitude_usable(message.q_ned_body) && R_second_first.allFinite();
  if (!f.valid) return f;
  f.R_second_first_body = R_body_cam * R_second_first * R_body_cam.transpose();
  f.R_level_second = R_level_body_of(message.q_ned_body);
  const auto& q = message.q_ned_body;
  const Quat first_ned = Quat(q[0], q[1], q[2], q[3]).normalized() * Quat(f.R_second_first_body);
  f.R_level_first = R_level_body_of({first_ned.w(), first_ned.x(), first_ned.y(), first_ned.z()});
  return f;
}

}  // namespace wasp::vision
