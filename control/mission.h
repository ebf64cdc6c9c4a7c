// The mission as a list of legs: arm, take off, fly each leg for its time, land, disarm. A leg is a height to hold, a
// forward speed, and a pilot's sticks as sines. It asks; the flight mode decides. It arms once, on request, and never
// again by itself.
#pragma once

#include <array>

#include "types/realtime.h"
#include "types/time.h"

namespace wasp::control {

struct HoverLeg {
  float height_m = 0.5f;
  float seconds = 40.f;
  float forward_mps = 0.f;                              ///< along the heading; needs a measured velocity
  float yaw_amplitude_radps = 0.f, yaw_period_s = 4.f;  ///< sticks: yaw rate ...
  float tilt_amplitude_rad = 0.f, tilt_period_s = 3.f;  ///< ... pitch, and roll with 1.37 of the period
  float bob_amplitude_m = 0.f, bob_period_s = 6.f;      ///< ... and height
  bool behaviours_climb = false;                        ///< a behaviour's wish to climb moves the height
};

struct MissionParams {
  static constexpr int kMaxLegs = 8;
  int leg_count = 0;
  std::array<HoverLeg, kMaxLegs> legs{};
  bool never_command = false;     ///< started again in flight: watch until the vehicle is disarmed, send nothing
  bool pilot_arms = false;        ///< wasp never asks to arm: it waits for the pilot without losing patience
  bool pilot_enters = false;      ///< likewise for the mode
  bool follow_recording = false;  ///< replay: arm, hold the height the recording shows, no take-off or landing
  float recording_seconds = 0.f;  ///< replay: length of the run
  float landed_margin_m = 0.06f;  ///< this close to the standing height counts as standing
  float patience_s = 20.f;        ///< give up if the autopilot does not arm or the ground is not seen by then
};

enum class MissionPhase : std::uint8_t {
  kWait = 0,
  kArm = 1,
  kLeg0 = 2,
  kLand = 20,
  kDisarm = 21,
  kDone = 22,
  kBroken = 23,
  kWatch = 24  ///< nothing is sent
};

struct MissionInput {
  TimeNs now_ns = 0;
  bool armed = false, follows = false, ground_seen = false;
  float height_m = 0, climb_rate_mps = 0;
  bool stop_requested = false;
  bool heard = true;            ///< the autopilot has said whether it is armed
  bool may_arm = true;          ///< false: something of ours is not as it must be for a flight
  bool ends_when_left = false;  ///< an autopilot that leaves our mode in flight ends the mission
};

/// Why a mission ended before its end.
enum class EarlyEnd : std::uint8_t {
  kNone = 0,
  kStopped,       ///< asked to: lands or disarms in order
  kFoundArmed,    ///< armed by somebody else when wasp began: never adopted
  kNoPatience,    ///< no ground in sight, or no arming, in time
  kDisarmed,      ///< disarmed in flight
  kNoGround,      ///< the landing took too long
  kNotDisarming,  ///< the autopilot did not disarm
  kModeTaken,     ///< the autopilot left our mode in flight: the pilot, or a failsafe of its own
  kRestarted,     ///< the flying process died and was started again: it never commands
};

struct MissionState {
  MissionPhase phase = MissionPhase::kWait;
  TimeNs since_ns = kNever;          ///< entry into the phase
  TimeNs settled_since_ns = kNever;  ///< on the ground since
  float ground_height_m = 0;         ///< camera height while standing
  float resting_height_m = 0;        ///< while landing: the height it has not left ...
  TimeNs resting_since_ns = kNever;  ///< ... since
  EarlyEnd early_end = EarlyEnd::kNone;
};

/// What the mission wants at this tick.
struct MissionWish {
  float target_m = 0;
  float forward_mps = 0;
  float yaw_rate_radps = 0, roll_rad = 0, pitch_rad = 0;  ///< sticks
  bool behaviours_climb = false;
  bool steer = false;   ///< on a leg: behaviours may turn the vehicle and set its pitch
  bool armed = false;   ///< ask the autopilot to be armed and to follow
  bool disarm = false;  ///< ask it to disarm
  bool rotors = false;  ///< false: zero thrust (standing on the ground)
};

/// Realtime-safe: yes.
MissionWish mission_step(const MissionParams& params, const MissionInput& input, MissionState& state) WASP_REALTIME;

/// Index of the leg a phase stands for, -1 if it is not one.
constexpr int leg_of(MissionPhase phase) WASP_REALTIME {
  const int i = static_cast<int>(phase) - static_cast<int>(MissionPhase::kLeg0);
  return i >= 0 && i < MissionParams::kMaxLegs ? i : -1;
}
const char* name_of(MissionPhase phase) WASP_REALTIME;
const char* name_of(EarlyEnd end) WASP_REALTIME;

}  // namespace wasp::control
