#include "control/control_step.h"

#include <cmath>

#include "types/frames.h"

namespace wasp::control {
namespace {

constexpr float kGravity_mps2 = 9.80665f;

Quat attitude_of(const ControlInput& in) noexcept {
  const auto& q = in.attitude.q_ned_body;
  return Quat(q[0], q[1], q[2], q[3]);
}

/// Upward acceleration from specific force: level at rest gives 0.
float accel_up(const ControlInput& in) noexcept {
  if (!in.attitude_present || !in.accel_present) return 0.f;
  const Vec3 force_ned = attitude_of(in) * Vec3(in.accel_body_mps2[0], in.accel_body_mps2[1], in.accel_body_mps2[2]);
  return -(force_ned.z() + kGravity_mps2);
}

float cos_tilt(const ControlInput& in) noexcept {
  return in.attitude_present ? (attitude_of(in) * Vec3::UnitZ()).z() : 1.f;
}

Situation assess(const ControlParams& p, const ControlInput& in, const Intention& intention, const ControlState& s,
                 bool finite) noexcept {
  Situation now;
  now.autopilot_armed = in.autopilot.armed;
  now.autopilot_follows = in.autopilot.follows;
  now.link_alive = in.autopilot.heard_at_ns != kNever && in.now_ns - in.autopilot.heard_at_ns <= p.link_age_limit_ns;
  now.attitude_fresh = in.attitude_present && in.now_ns - in.attitude.exposed_at_ns <= p.attitude_age_limit_ns;
  now.ground_seen = intention.height_source >= 0;
  now.ground_lost_long =
      !now.ground_seen && s.ground_seen_at_ns != kNever && in.now_ns - s.ground_seen_at_ns > p.ground_hold_limit_ns;
  now.setpoint_finite = finite;
  now.deadlines_missed = in.deadlines_missed;
  return now;
}

/// What behaviours and mission together want, before limits and mode.
Setpoint wanted_setpoint(const ControlParams& p, const ControlInput& in, const Intention& intention,
                         const MissionWish& wish, ControlState& s) noexcept {
  Setpoint wanted;
  if (!wish.rotors) {
    s.altitude_hold.engaged = false;
    return wanted;
  }
  wanted.pitch_rad = intention.pitch_rad;
  wanted.yaw_rate_radps = intention.heading_rate_radps;
  wanted.thrust = altitude_hold_step(p.altitude_hold, wish.target_m, s.height.height_m, s.height.climb_rate_mps,
                                     cos_tilt(in), in.dt_s, s.altitude_hold);
  return wanted;
}

/// The mode's own word: what goes out instead of, or as, the wanted setpoint.
Setpoint by_mode(const ControlParams& p, const ControlInput& in, FlightMode mode, const Setpoint& wanted) noexcept {
  Setpoint neutral;
  switch (mode) {
    case FlightMode::kBehaviour:
      return wanted;
    case FlightMode::kHold:
      neutral.thrust = wanted.thrust;
      return neutral;
    case FlightMode::kManual:
      neutral.thrust = hover_thrust(p.altitude_hold, cos_tilt(in));
      return neutral;
    case FlightMode::kFailsafe:
      neutral.thrust = p.failsafe_thrust_share * hover_thrust(p.altitude_hold, cos_tilt(in));
      return neutral;
    case FlightMode::kDisarmed:
      break;
  }
  return neutral;
}

/// Through the limits, from the last setpoint sent, into the command.
void put_setpoint(const ControlParams& p, const ControlInput& in, const Setpoint& chosen, ControlState& s,
                  Command& c) noexcept {
  s.sent = s.sent_before;
  if (!limit(p.limits, chosen, in.dt_s, s.sent)) s.sent = Setpoint{};  // cannot happen: neutral is finite
  const Quat q = quat_from_euler(
      {s.sent.roll_rad, s.sent.pitch_rad, in.attitude_present ? euler_from_quat(attitude_of(in)).yaw_rad : 0.f});
  c.q_ned_body = {q.w(), q.x(), q.y(), q.z()};
  c.yaw_rate_radps = s.sent.yaw_rate_radps;
  c.thrust = s.sent.thrust;
  c.mode = s.mode.mode;
  c.reason = s.mode.reason;
  const bool not_ours = in.autopilot.heard_at_ns == kNever || s.mission.phase == MissionPhase::kBroken;
  const bool stopped = s.mode.mode == FlightMode::kFailsafe && p.failsafe_action == FailsafeAction::kStopStream;
  c.sent = !not_ours && !stopped;
}

/// Until when the chosen setpoint may go out: only a flying mode that obeys cues or attitude rests on them.
void put_age_limits(const ControlParams& p, const ControlInput& in, const Intention& intention, FlightMode mode,
                    ControlOutput& out) noexcept {
  if (mode != FlightMode::kBehaviour && mode != FlightMode::kHold) return;
  out.attitude_until_ns = in.attitude.exposed_at_ns + p.attitude_age_limit_ns;
  if (mode == FlightMode::kBehaviour) out.cue_until_ns = intention.usable_until_ns;
}

}  // namespace

Refusal refusal_at(const ControlOutput& output, TimeNs now_ns) noexcept {
  if (now_ns > output.attitude_until_ns) return Refusal::kAttitudeTooOld;
  if (now_ns > output.cue_until_ns) return Refusal::kCueTooOld;
  return Refusal::kNone;
}

void refuse(const ControlParams& p, const ControlInput& in, Refusal refusal, ControlState& s,
            ControlOutput& out) noexcept {
  Setpoint wanted;
  wanted.thrust = out.command.thrust;
  s.mode = {refusal == Refusal::kCueTooOld ? FlightMode::kHold : FlightMode::kFailsafe, ModeReason::kTooOld};
  put_setpoint(p, in, by_mode(p, in, s.mode.mode, wanted), s, out.command);
  out.command.exposed_at_ns = kNever;
  out.command.cue_source = -1;
  out.command.refused = static_cast<std::uint8_t>(refusal);
}

ControlOutput control_step(const ControlParams& p, const ControlInput& in, ControlState& s) noexcept {
  const Intention intention = arbitrate(p.arbiter, in.cues, in.now_ns);
  predict(p.height_filter, accel_up(in), in.now_ns, s.height);
  if (intention.height_source >= 0) {
    s.ground_seen_at_ns = in.now_ns;
    correct(p.height_filter, intention.height_m, intention.height_exposed_at_ns, in.now_ns, s.height);
  }
  const MissionWish wish =
      mission_step(p.mission,
                   {in.now_ns, in.autopilot.armed, in.autopilot.follows, intention.height_source >= 0,
                    s.height.height_m, s.height.climb_rate_mps, in.stop_requested, in.autopilot.heard_at_ns != kNever},
                   s.mission);
  const Setpoint wanted = wanted_setpoint(p, in, intention, wish, s);
  s.sent_before = s.sent;
  Setpoint probe = s.sent;
  const bool finite = limit(p.limits, wanted, in.dt_s, probe);
  flight_mode_step(assess(p, in, intention, s, finite), s.mode);

  const bool standing = !wish.rotors && s.mode.mode != FlightMode::kManual;
  const Setpoint chosen = standing ? Setpoint{} : by_mode(p, in, s.mode.mode, wanted);
  ControlOutput out;
  Command& c = out.command;
  put_setpoint(p, in, chosen, s, c);
  if (!standing) put_age_limits(p, in, intention, s.mode.mode, out);
  c.exposed_at_ns = intention.oldest_exposed_at_ns;
  c.cue_source = intention.height_source;
  c.height_setpoint_m = wish.rotors ? s.altitude_hold.setpoint_m : 0.f;
  c.height_m = s.height.height_m;
  c.climb_rate_mps = s.height.climb_rate_mps;
  c.mission_phase = static_cast<std::uint8_t>(s.mission.phase);
  out.ask_arm = wish.armed && !(in.autopilot.armed && in.autopilot.follows) && s.mission.phase == MissionPhase::kArm;
  out.ask_disarm = wish.disarm && in.autopilot.armed;
  return out;
}

}  // namespace wasp::control
