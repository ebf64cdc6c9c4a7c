// Where the vehicle is, as the camera needs it.
#pragma once

#include "types/frames.h"
#include "types/time.h"

namespace wasp::sim {

struct BodyPose {
  TimeNs at_ns = 0;
  Vec3 position_ned_m = Vec3::Zero();
  Quat q_ned_body = Quat::Identity();
};

/// Pose at `at_ns` between (or a little beyond) two others; needs a.at_ns != b.at_ns unless they are the same pose.
inline BodyPose interpolate(const BodyPose& a, const BodyPose& b, TimeNs at_ns) {
  if (a.at_ns == b.at_ns) return {at_ns, b.position_ned_m, b.q_ned_body};
  const auto t = static_cast<float>(static_cast<double>(at_ns - a.at_ns) / static_cast<double>(b.at_ns - a.at_ns));
  return {at_ns, a.position_ned_m + t * (b.position_ned_m - a.position_ned_m), a.q_ned_body.slerp(t, b.q_ned_body)};
}

}  // namespace wasp::sim
