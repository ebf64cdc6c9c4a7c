#include "control/mission.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace wasp::control {
namespace {

constexpr DurationNs kLandedFor = 700 * kMillisecond, kUnmovedFor = 3 * kSecond;
constexpr float kUnmoved_m = 0.04f;
constexpr double kLongestLanding_s = 60.0, kLongestDisarm_s = 10.0;
constexpr float kBelowGround_m = 0.25f;  // landing target: firmly onto the floor

void enter(MissionState& s, MissionPhase phase, TimeNs now_ns) noexcept {
  s.phase = phase;
  s.since_ns = now_ns;
  s.settled_since_ns = s.resting_since_ns = kNever;
}

void end_early(MissionState& s, MissionPhase phase, EarlyEnd why, TimeNs now_ns) noexcept {
  s.early_end = why;
  enter(s, phase, now_ns);
}

MissionPhase leg_phase(int i) noexcept { return static_cast<MissionPhase>(static_cast<int>(MissionPhase::kLeg0) + i); }

/// Asked well below and not moving: what it stands on is not where the estimate of its height says the ground is.
bool unmoved(const MissionInput& in, MissionState& s) noexcept {
  if (!in.ground_seen || s.resting_since_ns == kNever || std::abs(in.height_m - s.resting_height_m) > kUnmoved_m) {
    s.resting_since_ns = in.now_ns;
    s.resting_height_m = in.height_m;
  }
  return in.now_ns - s.resting_since_ns >= kUnmovedFor;
}

bool standing_long_enough(const MissionParams& p, const MissionInput& in, MissionState& s) noexcept {
  if (!in.ground_seen || in.height_m > s.ground_height_m + p.landed_margin_m) {
    s.settled_since_ns = kNever;
    return false;
  }
  if (s.settled_since_ns == kNever) s.settled_since_ns = in.now_ns;
  return in.now_ns - s.settled_since_ns >= kLandedFor;
}

/// Everything of ours is ready, and the rest is up to somebody with a transmitter.
bool waits_for_pilot(const MissionParams& p, const MissionState& s) noexcept {
  return s.phase == MissionPhase::kArm && (p.pilot_arms || p.pilot_enters);
}

MissionWish wait_and_arm(const MissionParams& p, const MissionInput& in, MissionState& s, double in_phase_s) noexcept {
  MissionWish wish;
  const bool ready = in.heard && in.may_arm && (in.ground_seen || p.follow_recording);
  if (s.phase == MissionPhase::kWait && in.heard && in.armed) {
    end_early(s, MissionPhase::kBroken, EarlyEnd::kFoundArmed, in.now_ns);  // perhaps in the air: not ours
  } else if (in.stop_requested) {
    end_early(s, in.armed ? MissionPhase::kDisarm : MissionPhase::kDone, EarlyEnd::kStopped, in.now_ns);
  } else if (in_phase_s > static_cast<double>(p.patience_s) && !waits_for_pilot(p, s)) {
    end_early(s, MissionPhase::kBroken, EarlyEnd::kNoPatience, in.now_ns);
  } else if (s.phase == MissionPhase::kWait && ready) {
    s.ground_height_m = in.height_m;
    enter(s, MissionPhase::kArm, in.now_ns);
  } else if (s.phase == MissionPhase::kArm) {
    wish.armed = in.may_arm;
    if (!in.armed) s.ground_height_m = in.height_m;
    if (in.armed && in.follows) enter(s, leg_phase(0), in.now_ns);
  }
  wish.target_m = in.height_m;
  return wish;
}

/// Started again in flight, or the mode taken away: whatever the vehicle does now is not ours. Over once it is disarmed
/// for a second.
MissionWish watch(const MissionParams& p, const MissionInput& in, MissionState& s, double in_phase_s) noexcept {
  if (!in.heard || in.armed) s.settled_since_ns = kNever;
  if (in.heard && !in.armed && s.settled_since_ns == kNever) s.settled_since_ns = in.now_ns;
  const bool disarmed = s.settled_since_ns != kNever && in.now_ns - s.settled_since_ns >= kSecond;
  const bool unheard = !in.heard && in_phase_s > static_cast<double>(p.patience_s);
  const EarlyEnd why = s.early_end == EarlyEnd::kNone ? EarlyEnd::kRestarted : s.early_end;
  if (disarmed || unheard || in.stop_requested) end_early(s, MissionPhase::kBroken, why, in.now_ns);
  return {};
}

/// The sticks of a leg `t_s` after its start. They rest for the first second, so that a leg starts from hover.
void move_sticks(const HoverLeg& leg, double t_s, MissionWish& wish) noexcept {
  const auto wave = [t_s](float amplitude, float period_s) noexcept {
    const double turns = std::max(0.0, t_s - 1.0) / static_cast<double>(period_s);
    return amplitude * static_cast<float>(std::sin(2 * std::numbers::pi * turns));
  };
  constexpr float kRollPeriods = 1.37f;  // so that roll and pitch meet in all combinations
  wish.yaw_rate_radps = wave(leg.yaw_amplitude_radps, leg.yaw_period_s);
  wish.pitch_rad = wave(leg.tilt_amplitude_rad, leg.tilt_period_s);
  wish.roll_rad = wave(leg.tilt_amplitude_rad, kRollPeriods * leg.tilt_period_s);
  wish.target_m += wave(leg.bob_amplitude_m, leg.bob_period_s);
}

/// Nobody fights for a mode: what the pilot, or a failsafe of the autopilot, took is theirs.
bool taken_away(const MissionInput& in) noexcept { return in.ends_when_left && in.armed && !in.follows; }

MissionWish fly_leg(const MissionParams& p, const MissionInput& in, MissionState& s, double in_phase_s) noexcept {
  const int leg = leg_of(s.phase);
  const bool last = p.follow_recording || leg + 1 >= p.leg_count;
  const double length_s =
      static_cast<double>(p.follow_recording ? p.recording_seconds : p.legs[static_cast<std::size_t>(leg)].seconds);
  MissionWish wish;
  if (p.follow_recording && in.ground_seen && s.ground_height_m <= 0.f) s.ground_height_m = in.height_m;
  wish.rotors = !p.follow_recording || s.ground_height_m > 0.f;  // a recording is followed from its first height on
  wish.armed = true;
  wish.target_m = p.follow_recording ? s.ground_height_m : p.legs[static_cast<std::size_t>(leg)].height_m;
  if (!p.follow_recording) {
    const HoverLeg& row = p.legs[static_cast<std::size_t>(leg)];
    wish.forward_mps = row.forward_mps;
    wish.behaviours_climb = row.behaviours_climb;
    move_sticks(row, in_phase_s, wish);
  }
  wish.steer = true;
  if (!in.armed)
    end_early(s, MissionPhase::kBroken, EarlyEnd::kDisarmed, in.now_ns);  // never armed again from here
  else if (taken_away(in))
    end_early(s, MissionPhase::kWatch, EarlyEnd::kModeTaken, in.now_ns);
  else if (in.stop_requested)
    end_early(s, p.follow_recording ? MissionPhase::kDisarm : MissionPhase::kLand, EarlyEnd::kStopped, in.now_ns);
  else if (in_phase_s >= length_s && !last)
    enter(s, leg_phase(leg + 1), in.now_ns);
  else if (in_phase_s >= length_s)
    enter(s, p.follow_recording ? MissionPhase::kDisarm : MissionPhase::kLand, in.now_ns);
  return wish;
}

}  // namespace

MissionWish mission_step(const MissionParams& p, const MissionInput& in, MissionState& s) noexcept {
  if (s.since_ns == kNever) enter(s, p.never_command ? MissionPhase::kWatch : s.phase, in.now_ns);
  const double in_phase_s = to_seconds(in.now_ns - s.since_ns);
  MissionWish wish;
  switch (s.phase) {
    case MissionPhase::kWait:
    case MissionPhase::kArm:
      return wait_and_arm(p, in, s, in_phase_s);
    case MissionPhase::kLand:
      wish.target_m = s.ground_height_m - kBelowGround_m;
      wish.armed = wish.rotors = true;
      if (!in.armed)
        enter(s, MissionPhase::kDone, in.now_ns);
      else if (taken_away(in))
        end_early(s, MissionPhase::kWatch, EarlyEnd::kModeTaken, in.now_ns);
      else if (standing_long_enough(p, in, s) || unmoved(in, s))
        enter(s, MissionPhase::kDisarm, in.now_ns);
      else if (in_phase_s > kLongestLanding_s)
        end_early(s, MissionPhase::kBroken, EarlyEnd::kNoGround, in.now_ns);
      return wish;
    case MissionPhase::kDisarm:
      wish.disarm = !taken_away(in);
      if (!in.armed)
        enter(s, MissionPhase::kDone, in.now_ns);
      else if (taken_away(in))
        end_early(s, MissionPhase::kWatch, EarlyEnd::kModeTaken, in.now_ns);
      else if (in_phase_s > kLongestDisarm_s)
        end_early(s, MissionPhase::kBroken, EarlyEnd::kNotDisarming, in.now_ns);
      return wish;
    case MissionPhase::kDone:
    case MissionPhase::kBroken:
      return wish;
    case MissionPhase::kWatch:
      return watch(p, in, s, in_phase_s);
    default:
      return fly_leg(p, in, s, in_phase_s);
  }
}

const char* name_of(MissionPhase phase) noexcept {
  switch (phase) {
    case MissionPhase::kWait:
      return "waiting for the ground and the autopilot";
    case MissionPhase::kArm:
      return "arming";
    case MissionPhase::kLand:
      return "landing";
    case MissionPhase::kDisarm:
      return "disarming";
    case MissionPhase::kDone:
      return "done";
    case MissionPhase::kBroken:
      return "broken off";
    case MissionPhase::kWatch:
      return "watching only";
    default:
      return "hover";
  }
}

const char* name_of(EarlyEnd end) noexcept {
  constexpr std::array kNames = {"none",
                                 "stop requested",
                                 "found armed, not adopted: it may be in the air; disarm it and start again",
                                 "the ground was not seen or the autopilot did not arm in time",
                                 "disarmed in flight",
                                 "no ground found while landing",
                                 "the autopilot did not disarm",
                                 "the autopilot left our mode: the pilot's, or its own failsafe's, from here on",
                                 "the flying process was started again in flight and only watches"};
  const auto i = static_cast<std::size_t>(end);
  return i < kNames.size() ? kNames[i] : "unknown";
}

}  // namespace wasp::control
