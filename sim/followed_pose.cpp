#include "sim/followed_pose.h"

#include <algorithm>
#include <utility>

namespace wasp::sim {

void FollowedPose::attitude(const AttitudeFix& fix, TimeNs arrived_at_ns) {
  const std::lock_guard lock(mutex_);
  attitude_lag_.add(fix.at_ns, arrived_at_ns);
  track_.add(placement_.place(fix));
}

void FollowedPose::position(const ReportedPosition& reported, TimeNs at_ns, TimeNs arrived_at_ns) {
  const std::lock_guard lock(mutex_);
  position_lag_.add(at_ns, arrived_at_ns);
  if (track_.add(placement_.place(reported, at_ns))) texts_.emplace_back("the position jumped; it is taken as it is");
}

void FollowedPose::armed(bool armed) {
  const std::lock_guard lock(mutex_);
  placement_.armed(armed);
}

void FollowedPose::source_changed() {
  const std::lock_guard lock(mutex_);
  placement_.source_changed();
}

void FollowedPose::restarted() {
  const std::lock_guard lock(mutex_);
  placement_.restarted();
  track_.clear();
  attitude_lag_ = position_lag_ = {};
}

std::optional<BodyPose> FollowedPose::at(TimeNs at_ns) const {
  const std::lock_guard lock(mutex_);
  auto pose = track_.at(at_ns);
  if (pose) pose->flight_time_s = placement_.flight_time_s(at_ns);
  return pose;
}

DurationNs FollowedPose::delay_ns() const {
  if (params_.delay_ns > 0) return params_.delay_ns;
  const std::lock_guard lock(mutex_);
  const DurationNs lag_ns = std::max(attitude_lag_.usual_ns(), position_lag_.usual_ns());
  return std::clamp(lag_ns + kMargin, kLeastDelay, kMostDelay);
}

DurationNs FollowedPose::patience_ns() const {
  const DurationNs delay = delay_ns();
  const std::lock_guard lock(mutex_);
  const DurationNs worst_ns = std::max(attitude_lag_.worst_ns(), position_lag_.worst_ns());
  return std::clamp(worst_ns + kMargin - delay, kLeastPatience, kMostDelay);
}

double FollowedPose::attitude_rate_hz(TimeNs now_ns) const {
  const std::lock_guard lock(mutex_);
  return attitude_lag_.rate_hz(now_ns);
}

double FollowedPose::position_rate_hz(TimeNs now_ns) const {
  const std::lock_guard lock(mutex_);
  return position_lag_.rate_hz(now_ns);
}

void FollowedPose::say(std::string text) {
  const std::lock_guard lock(mutex_);
  texts_.push_back(std::move(text));
}

std::vector<std::string> FollowedPose::take_texts() {
  const std::lock_guard lock(mutex_);
  return std::exchange(texts_, {});
}

}  // namespace wasp::sim
