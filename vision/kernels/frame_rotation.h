// The camera's own turn between two frames, from the vehicle's attitude at each.
#pragma once

#include <array>

#include "types/frames.h"
#include "types/realtime.h"

namespace wasp::vision {

/// R_second_first, camera axes: a point at infinity seen along d in the first frame is seen along R_second_first d in
/// the second. d is R_ned_first R_body_cam d in the world, hence R_cam_body R_second_ned R_ned_first R_body_cam.
/// Attitudes are w x y z, body to NED, of about unit length. Realtime-safe: yes.
inline Mat3 frame_rotation(const Mat3& R_body_cam, const std::array<float, 4>& first_ned_body,
                           const std::array<float, 4>& second_ned_body) WASP_REALTIME {
  const auto quat = [](const std::array<float, 4>& q)
                        WASP_REALTIME { return Quat(q[0], q[1], q[2], q[3]).normalized(); };
  const Quat turn_second_first = quat(second_ned_body).conjugate() * quat(first_ned_body);
  return R_body_cam.transpose() * turn_second_first.toRotationMatrix() * R_body_cam;
}

}  // namespace wasp::vision
