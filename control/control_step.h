// One control period, pure: cues -> arbiter -> altitude hold -> limits -> flight mode -> one command. The real-time
// loop and the lockstep simulation call this same function.
#pragma once

#include "control/altitude_hold.h"
#include "control/arbiter.h"
#include "control/barometer.h"
#include "control/flight_mode.h"
#include "control/height_filter.h"
#include "control/hover_share.h"
#include "control/limits.h"
#include "control/mission.h"
#include "control/velocity_hold.h"
#include "types/autopilot_semantics.h"
#include "types/messages.h"
#include "types/realtime.h"

namespace wasp::control {

enum class FailsafeAction : std::uint8_t { kDescend, kStopStream };

struct ControlParams {
  ArbiterParams arbiter;
  HeightFilterParams height_filter;
  AltitudeHoldParams altitude_hold;
  BarometerParams barometer;  ///< the last height source, where enabled
  VelocityFilterParams velocity_filter;
  VelocityHoldParams velocity_hold;
  LimitParams limits;
  MissionParams mission;
  DurationNs attitude_age_limit_ns = 200 * kMillisecond;
  DurationNs link_age_limit_ns = 240 * kMillisecond;  ///< silence after which the link counts as lost
  DurationNs ground_hold_limit_ns = 1 * kSecond;      ///< how long to hold on the accelerometer alone
  float avoid_hold_s = 3.f;                           ///< forward speed stays zero this long after avoid was raised
  float avoid_brake_rad =
      0.0873f;                ///< nose-up for the first second of an avoid where no held velocity brakes; 0: level
  bool hold_heading = false;  ///< while nobody steers, keep the heading of the moment nobody began to
  float min_height_m = 0.3f, max_height_m = 4.f;  ///< where behaviours may climb and sink to
  float failsafe_thrust_share = 0.96f;            ///< of hover thrust: a gentle descent
  float failsafe_sink_mps = 0.3f;                 ///< the same where a climb rate is asked for
  FailsafeAction failsafe_action = FailsafeAction::kDescend;
};

/// What the autopilot last said of itself.
struct AutopilotState {
  TimeNs heard_at_ns = kNever;  ///< any valid frame
  bool armed = false;
  bool follows = false;  ///< in the mode in which it obeys setpoints
  AutopilotSemantics semantics;
};

struct ControlInput {
  TimeNs now_ns = 0;
  float dt_s = 0.05f;
  CueSet cues;
  bool attitude_present = false;
  AttitudeSample attitude;
  bool accel_present = false;
  std::array<float, 3> accel_body_mps2{};  ///< mean specific force since the last tick
  float pressure_hpa = 0;                  ///< mean of those since the last tick; 0: none came
  AutopilotState autopilot;
  bool stop_requested = false;
  bool deadlines_missed = false;  ///< the last two ticks
  bool may_arm = true;            ///< false: on the ground, arming waits
};

struct ControlState {
  HeightFilterState height;
  AltitudeHoldState altitude_hold;
  BarometerState barometer;
  VelocityFilterState velocity;
  TimeNs velocity_until_ns = kNever;  ///< the cue that `velocity` rests on reaches its age limit
  VelocityHoldState velocity_hold;
  TimeNs avoid_raised_at_ns = kNever, avoid_heard_at_ns = kNever;  ///< its first tick and its latest
  float held_yaw_rad = 0;
  bool holding_yaw = false;
  HoverShareState hover;
  TimeNs stopping_since_ns = kNever;              ///< failsafe by silence: its level last words began
  float heading_rad = 0, heading_before_rad = 0;  ///< commanded, where the heading is commanded: of this tick, the last
  bool heading_held = false;
  Setpoint sent, sent_before;  ///< of this tick and of the one before
  ModeState mode;
  MissionState mission;
  TimeNs ground_seen_at_ns = kNever;
};

/// The command, what to ask of the autopilot besides, and until when the command may go out.
struct ControlOutput {
  Command command;
  bool ask_follow = false;  ///< to enter the mode in which it obeys
  bool ask_arm = false, ask_disarm = false;
  float neutral_thrust = 0;  ///< what whoever must speak in our place sends, level: a gentle descent; 0 on the ground
  TimeNs cue_until_ns = kForever;       ///< a cue it rests on reaches its age limit
  TimeNs attitude_until_ns = kForever;  ///< the attitude it rests on does
};

/// Why a command must not go out at the moment it would: the age limits, asked again right before the bytes leave.
enum class Refusal : std::uint8_t { kNone = 0, kCueTooOld = 1, kAttitudeTooOld = 2 };

/// Realtime-safe: yes.
Refusal refusal_at(const ControlOutput& output, TimeNs now_ns) WASP_REALTIME;

/// Realtime-safe: yes. Command::sent is 1 when the setpoint must go out, 0 when the stream stops on purpose.
ControlOutput control_step(const ControlParams& params, const ControlInput& input, ControlState& state) WASP_REALTIME;

/// Puts in the place of a refused command what the flight mode says of the loss: hold for a cue, failsafe for the
/// attitude, through the same limits. `refusal` != kNone. Realtime-safe: yes.
void refuse(const ControlParams& params, const ControlInput& input, Refusal refusal, ControlState& state,
            ControlOutput& output) WASP_REALTIME;

}  // namespace wasp::control
