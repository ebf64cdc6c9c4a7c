// Frames and rotations. World: local NED (x north, y east, z down). Body: FRD (x forward, y right, z down).
// Camera (optical): x right, y down, z forward. `R_a_b` takes b-coordinates to a-coordinates: v_a = R_a_b * v_b,
// so adjacent names match. Euler angles are yaw-pitch-roll (Z-Y-X). Altitude is -z, up positive.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "types/units.h"

namespace wasp {

using Vec3 = Eigen::Vector3f;
using Mat3 = Eigen::Matrix3f;
using Quat = Eigen::Quaternionf;

/// Roll, pitch, yaw of a body in NED [rad].
struct Euler {
  float roll_rad = 0, pitch_rad = 0, yaw_rad = 0;
};

/// Attitude quaternion q_ned_body (body FRD to NED) from Euler angles, Z-Y-X.
inline Quat quat_from_euler(const Euler& e) noexcept {
  return Eigen::AngleAxisf(e.yaw_rad, Vec3::UnitZ()) * Eigen::AngleAxisf(e.pitch_rad, Vec3::UnitY()) *
         Eigen::AngleAxisf(e.roll_rad, Vec3::UnitX());
}

/// Inverse of quat_from_euler; pitch is clamped to +-pi/2 at the pole.
inline Euler euler_from_quat(const Quat& q) noexcept {
  const float sin_pitch = 2.f * (q.w() * q.y() - q.z() * q.x());
  return {std::atan2(2.f * (q.w() * q.x() + q.y() * q.z()), 1.f - 2.f * (q.x() * q.x() + q.y() * q.y())),
          std::asin(std::fmin(1.f, std::fmax(-1.f, sin_pitch))),
          std::atan2(2.f * (q.w() * q.z() + q.x() * q.y()), 1.f - 2.f * (q.y() * q.y() + q.z() * q.z()))};
}

/// R_body_cam of a camera looking forward and tilted down by `pitch_down` (0: optical axis along body x,
/// 90 degrees: straight down with the image's top towards the front).
inline Mat3 R_body_cam_from_pitch_down(Radians pitch_down) noexcept {
  const auto s = static_cast<float>(std::sin(pitch_down.value)), c = static_cast<float>(std::cos(pitch_down.value));
  Mat3 R_body_cam;
  R_body_cam << 0, -s, c,  // camera y (down) tilts to -x, camera z (forward) is x
      1, 0, 0,             // camera x (right) is body y
      0, c, s;             // camera y is body z, camera z tilts to +z
  return R_body_cam;
}

}  // namespace wasp
