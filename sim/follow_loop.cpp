#include "sim/follow_loop.h"

#include <cstdio>
#include <string>

#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::sim {
namespace {

constexpr DurationNs kBlindAfter = 500 * kMillisecond;
constexpr DurationNs kLateFrames = 70 * kMillisecond;  // flight's age limits are about 95 ms

std::string milliseconds(DurationNs ns) { return std::to_string(ns / kMillisecond) + " ms"; }

}  // namespace

void FollowLoop::Exposures::pass(std::uint32_t n) {
  sequence += n;
  next_ns += n * period_ns;
}

FollowLoop::Exposures::Exposures(CameraView view, TimeNs start_ns, const shm::Region& region, const char* gray,
                                 const char* depth)
    : eye(view, start_ns, rt::OverrunPolicy::kSkip, region, gray, depth),
      period_ns(from_seconds(1 / view.rate_hz)),
      next_ns(start_ns) {}

FollowLoop::FollowLoop(CameraView front, std::optional<CameraView> down, TimeNs start_ns, const shm::Region& region,
                       FollowedPose& pose)
    : front_(front, start_ns, region, shm::kGray, shm::kDepth), pose_(pose), shown_until_ns_(start_ns) {
  if (down) down_.emplace(*down, start_ns + from_seconds(0.5 / down->rate_hz), region, shm::kGrayDown, nullptr);
}

void FollowLoop::run(const std::atomic<bool>& stop) {
  while (!stop.load(std::memory_order_relaxed))
    expose(down_ && down_->next_ns < front_.next_ns ? *down_ : front_, stop);
}

/// Waits until its time has come, and a little longer for a pose that is late itself.
std::optional<BodyPose> FollowLoop::wait_for_pose(TimeNs exposure_ns, const std::atomic<bool>& stop) {
  const DurationNs delay_ns = pose_.delay_ns();
  tell_delay(delay_ns);
  const TimeNs due_ns = exposure_ns + delay_ns;
  while (rt::now() < due_ns && !stop.load(std::memory_order_relaxed))
    rt::sleep_until(std::min(due_ns, rt::now() + 20 * kMillisecond));
  for (;;) {
    if (auto pose = pose_.at(exposure_ns)) return pose;
    if (rt::now() >= due_ns + pose_.patience_ns() || stop.load(std::memory_order_relaxed)) return std::nullopt;
    rt::sleep_until(rt::now() + kMillisecond);
  }
}

void FollowLoop::expose(Exposures& camera, const std::atomic<bool>& stop) {
  const TimeNs exposure_ns = camera.next_ns;
  const auto pose = wait_for_pose(exposure_ns, stop);
  tell(exposure_ns, pose.has_value());
  if (pose)
    camera.eye.publish(*pose, camera.sequence);
  else
    camera.eye.count_skipped(1);
  camera.pass(1);
  // Rendering slower than the rate: what could only be shown late is passed over.
  const DurationNs late_ns = rt::now() - pose_.delay_ns() - pose_.patience_ns() - camera.next_ns;
  if (late_ns <= camera.period_ns) return;
  const auto passed = static_cast<std::uint32_t>(late_ns / camera.period_ns);
  camera.eye.count_skipped(passed);
  camera.pass(passed);
}

void FollowLoop::tell(TimeNs exposure_ns, bool known) {
  if (known) {
    if (!shown_) pose_.say("the vehicle's place is known: the camera shows");
    if (blind_)
      pose_.say("the vehicle's place is known again after " + milliseconds(exposure_ns - shown_until_ns_) +
                ": the camera goes on");
    shown_ = true;
    blind_ = false;
    shown_until_ns_ = exposure_ns;
    return;
  }
  if (!shown_ || blind_ || exposure_ns - shown_until_ns_ < kBlindAfter) return;
  blind_ = true;
  pose_.say("the vehicle's place is not known any more: the camera shows nothing");
}

/// When it changes by a quarter.
void FollowLoop::tell_delay(DurationNs delay_ns) {
  if (!shown_ || std::abs(delay_ns - told_delay_ns_) * 4 < told_delay_ns_ || blind_) return;
  if (told_delay_ns_ != 0 && std::abs(delay_ns - told_delay_ns_) < 10 * kMillisecond) return;
  told_delay_ns_ = delay_ns;
  pose_.say("pictures are drawn " + milliseconds(delay_ns) + " after their exposure" +
            (delay_ns > kLateFrames ? ": poses come too seldom for a flight, whose cues must be younger" : ""));
}

}  // namespace wasp::sim
