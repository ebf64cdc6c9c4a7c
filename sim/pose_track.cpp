#include "sim/pose_track.h"

#include <algorithm>

namespace wasp::sim {
namespace {

float seconds_between(TimeNs from_ns, TimeNs to_ns) { return static_cast<float>(to_seconds(to_ns - from_ns)); }

Quat turned(const Quat& q, const Vec3& rate_body_radps, float seconds) {
  const float angle = rate_body_radps.norm() * seconds;
  if (!(std::abs(angle) > 1e-9f)) return q;
  return (q * Quat(Eigen::AngleAxisf(angle, rate_body_radps.normalized()))).normalized();
}

/// From the end before, turned on, to the end after, turned back; the weights meet with no kink.
void attitude_between(const AttitudeFix& a, const AttitudeFix& b, TimeNs at_ns, BodyPose& pose) {
  const float whole = seconds_between(a.at_ns, b.at_ns), since = seconds_between(a.at_ns, at_ns);
  const float t = since / whole, smooth = t * t * (3.f - 2.f * t);
  const Quat forward = turned(a.q_ned_body, a.rate_body_radps, since);
  const Quat backward = turned(b.q_ned_body, b.rate_body_radps, since - whole);
  pose.q_ned_body = forward.slerp(smooth, backward);
  pose.rate_body_radps = a.rate_body_radps + t * (b.rate_body_radps - a.rate_body_radps);
}

/// Cubic Hermite.
void position_between(const PositionFix& a, const PositionFix& b, TimeNs at_ns, BodyPose& pose) {
  const float whole = seconds_between(a.at_ns, b.at_ns), t = seconds_between(a.at_ns, at_ns) / whole;
  const float t2 = t * t, t3 = t2 * t;
  const Vec3 way = b.position_ned_m - a.position_ned_m;
  const Vec3 va = whole * a.velocity_ned_mps, vb = whole * b.velocity_ned_mps;
  pose.position_ned_m = a.position_ned_m + (3 * t2 - 2 * t3) * way + (t3 - 2 * t2 + t) * va + (t3 - t2) * vb;
  pose.velocity_ned_mps =
      ((6 * t - 6 * t2) * way + (3 * t2 - 4 * t + 1) * va + (3 * t2 - 2 * t) * vb) / std::max(whole, 1e-6f);
}

}  // namespace

bool PoseTrack::add(const PositionFix& fix) {
  const bool had = !positions_.empty();
  const PositionFix last = had ? positions_.newest() : PositionFix{};
  if (!positions_.add(fix) || !had) return false;
  const float whole = seconds_between(last.at_ns, fix.at_ns);
  const Vec3 told = 0.5f * whole * (last.velocity_ned_mps + fix.velocity_ned_mps);
  const bool jumped = (fix.position_ned_m - last.position_ned_m - told).norm() > kJump_m + 0.5f * told.norm();
  if (jumped) jumped_after_ns_ = last.at_ns, jumped_at_ns_ = fix.at_ns;
  return jumped;
}

void PoseTrack::clear() {
  attitudes_.clear();
  positions_.clear();
  jumped_after_ns_ = jumped_at_ns_ = kNever;
}

std::optional<BodyPose> PoseTrack::at(TimeNs at_ns) const {
  const auto attitude = attitudes_.around(at_ns);
  const auto position = positions_.around(at_ns);
  if (!attitude || !position) return std::nullopt;
  if (attitude->after.at_ns - attitude->before.at_ns > kLongestGap ||
      position->after.at_ns - position->before.at_ns > kLongestGap)
    return std::nullopt;
  if (jumped_at_ns_ != kNever && at_ns > jumped_after_ns_ && at_ns < jumped_at_ns_) return std::nullopt;
  BodyPose pose;
  pose.at_ns = at_ns;
  attitude_between(attitude->before, attitude->after, at_ns, pose);
  position_between(position->before, position->after, at_ns, pose);
  return pose;
}

TimeNs PoseTrack::known_until_ns() const {
  if (attitudes_.empty() || positions_.empty()) return kNever;
  return std::min(attitudes_.newest().at_ns, positions_.newest().at_ns);
}

}  // namespace wasp::sim
