// Where the vehicle is and how it moves, as the camera needs it.
#pragma once

#include "types/frames.h"
#include "types/time.h"

namespace wasp::sim {

struct BodyPose {
  TimeNs at_ns = 0;
  Vec3 position_ned_m = Vec3::Zero();
  Quat q_ned_body = Quat::Identity();
  Vec3 velocity_ned_mps = Vec3::Zero();
  Vec3 rate_body_radps = Vec3::Zero();
  double flight_time_s = 0;  ///< since the vehicle first left the ground: the time of what moves in the world
};

/// Pose at `at_ns` between (or a little beyond) two others; needs a.at_ns != b.at_ns unless they are the same pose.
inline BodyPose interpolate(const BodyPose& a, const BodyPose& b, TimeNs at_ns) {
  BodyPose pose = b;
  pose.at_ns = at_ns;
  if (a.at_ns == b.at_ns) return pose;
  const auto t = static_cast<float>(static_cast<double>(at_ns - a.at_ns) / static_cast<double>(b.at_ns - a.at_ns));
  pose.position_ned_m = a.position_ned_m + t * (b.position_ned_m - a.position_ned_m);
  pose.q_ned_body = a.q_ned_body.slerp(t, b.q_ned_body);
  pose.velocity_ned_mps = a.velocity_ned_mps + t * (b.velocity_ned_mps - a.velocity_ned_mps);
  pose.rate_body_radps = a.rate_body_radps + t * (b.rate_body_radps - a.rate_body_radps);
  pose.flight_time_s = a.flight_time_s + static_cast<double>(t) * (b.flight_time_s - a.flight_time_s);
  return pose;
}

/// The pose `after_s` later (or earlier) with velocity and body rate as they are: good for an exposure, some 10 ms.
inline BodyPose moved(const BodyPose& pose, float after_s) {
  BodyPose next = pose;
  next.at_ns += from_seconds(static_cast<double>(after_s));
  next.position_ned_m += after_s * pose.velocity_ned_mps;
  const float rate = pose.rate_body_radps.norm();
  if (rate > 0.f) {
    const Eigen::AngleAxisf turn(rate * after_s, pose.rate_body_radps / rate);
    next.q_ned_body = (pose.q_ned_body * Quat(turn)).normalized();
  }
  return next;
}

}  // namespace wasp::sim
