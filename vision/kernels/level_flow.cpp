// `still` ends in the first frame's axes, `seen` in the second's. Both are turned by the attitude of the first frame,
// which is that of the second with the turn taken back; a `seen` end keeps the turn, which is what kSeen is for.
#include "vision/kernels/level_flow.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/camera_model.h"
#include "vision/kernels/derotate.h"

namespace wasp::vision {
namespace {

Mat3 turn_of(const FlowMessage& m) noexcept {
  Mat3 R;
  R << m.R_second_first[0], m.R_second_first[1], m.R_second_first[2], m.R_second_first[3], m.R_second_first[4],
      m.R_second_first[5], m.R_second_first[6], m.R_second_first[7], m.R_second_first[8];
  return R;
}

bool is_rotation(const Mat3& R) noexcept {
  return R.allFinite() && (R * R.transpose() - Mat3::Identity()).squaredNorm() < 4e-4f;
}

/// Level axes from the camera's at the second frame.
Mat3 level_from_camera(const CameraGeometry& camera, const FlowMessage& m) noexcept {
  const auto& a = m.q_ned_body;
  const Quat q = Quat(a[0], a[1], a[2], a[3]).normalized();
  const Mat3 R_ned_body = q.toRotationMatrix();
  const float yaw = std::atan2(R_ned_body(1, 0), R_ned_body(0, 0));
  const float c = std::cos(yaw), s = std::sin(yaw);
  Mat3 R_level_ned;
  R_level_ned << c, s, 0, -s, c, 0, 0, 0, 1;
  return R_level_ned * R_ned_body * camera.R_body_cam;
}

float wrapped(float angle) noexcept {
  constexpr float kPi = 3.14159265f;
  return angle > kPi ? angle - 2.f * kPi : angle < -kPi ? angle + 2.f * kPi : angle;
}

bool level_cell(const Lens& lens, const Mat3& R_level_cam, const FlowCell& cell, float depth_m, float interval_s,
                LevelCell& out) noexcept {
  out = {};
  Vec3 d;
  const bool known = std::isfinite(depth_m) && depth_m > 0.f;
  if ((cell.valid == 0 && !known) || !std::isfinite(cell.x_px + cell.y_px)) return false;
  if (!direction_of(lens, {cell.x_px, cell.y_px}, d)) return false;
  out.first = R_level_cam * d;
  out.azimuth_rad = std::atan2(out.first.y(), out.first.x());
  out.elevation_rad = std::asin(std::clamp(-out.first.z(), -1.f, 1.f));
  if (known && d.z() > 0.05f) out.depth_m = depth_m / d.z();
  Vec3 e;
  out.moved = cell.valid != 0 && std::isfinite(cell.u_px + cell.v_px) &&
              direction_of(lens, {cell.x_px + cell.u_px, cell.y_px + cell.v_px}, e);
  if (out.moved) {
    out.second = R_level_cam * e;
    out.azimuth_rate_radps = wrapped(std::atan2(out.second.y(), out.second.x()) - out.azimuth_rad) / interval_s;
  }
  return out.moved || out.depth_m > 0.f;
}

}  // namespace

void level_flow(const CameraGeometry& camera, const FlowMessage* message, FlowKind kind, LevelFlow& out) noexcept {
  out.valid = false;
  out.count = 0;
  if (message == nullptr || !usable(camera.intrinsics) || !camera.R_body_cam.allFinite()) return;
  const FlowMessage& m = *message;
  const FlowField& field = kind == FlowKind::kStill ? m.still : m.seen;
  if (field.columns < 1 || field.rows < 1 || field.columns > FlowField::kMaxColumns || field.rows > FlowField::kMaxRows)
    return;
  out.interval_s = elapsed_s(m.first_exposed_at_ns, m.exposed_at_ns);
  if (!(out.interval_s > 0.f && out.interval_s <= kMaxFlowInterval_s) || !attitude_usable(m.q_ned_body)) return;
  if (kind == FlowKind::kStill && m.derotated == 0) return;
  const Mat3 turn = turn_of(m);
  if (m.derotated != 0 && !is_rotation(turn)) return;
  const Mat3 R_level_second = level_from_camera(camera, m);
  const Mat3 R_level_first = m.derotated != 0 ? Mat3(R_level_second * turn) : R_level_second;
  // R_second_first = 1 - [w dt]x for a camera that turns by w dt.
  const Vec3 turned_cam = 0.5f * Vec3(turn(1, 2) - turn(2, 1), turn(2, 0) - turn(0, 2), turn(0, 1) - turn(1, 0));
  out.yaw_rate_radps = m.derotated != 0 ? (R_level_second * turned_cam).z() / out.interval_s : 0.f;
  const Lens lens = camera.lens();
  for (int i = 0; i < field.count(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (level_cell(lens, R_level_first, field.cells[k], m.depth_m[k], out.interval_s,
                   out.cells[static_cast<std::size_t>(out.count)]))
      ++out.count;
  }
  out.valid = true;
}

}  // namespace wasp::vision
