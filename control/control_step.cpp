#include "control/control_step.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "types/frames.h"

namespace wasp::control {
namespace {

constexpr float kGravity_mps2 = 9.80665f;

Quat attitude_of(const ControlInput& in) noexcept {
  const auto& q = in.attitude.q_ned_body;
  return Quat(q[0], q[1], q[2], q[3]);
}

/// There, and an attitude: a torn or overwritten sample is none.
bool has_attitude(const ControlInput& in) noexcept {
  if (!in.attitude_present) return false;
  const float squared = attitude_of(in).squaredNorm();
  return squared > 0.9f && squared < 1.1f;  // NaN fails both
}

/// Upward acceleration from specific force: level at rest gives 0.
float accel_up(const ControlInput& in) noexcept {
  if (!has_attitude(in) || !in.accel_present) return 0.f;
  const Vec3 force_ned = attitude_of(in) * Vec3(in.accel_body_mps2[0], in.accel_body_mps2[1], in.accel_body_mps2[2]);
  return -(force_ned.z() + kGravity_mps2);
}

float cos_tilt(const ControlInput& in) noexcept {
  return has_attitude(in) ? (attitude_of(in) * Vec3::UnitZ()).z() : 1.f;
}

Situation assess(const ControlParams& p, const ControlInput& in, bool height_seen, bool images, const ControlState& s,
                 bool finite) noexcept {
  Situation now;
  now.autopilot_armed = in.autopilot.armed;
  now.autopilot_follows = in.autopilot.follows;
  now.link_alive = in.autopilot.heard_at_ns != kNever && in.now_ns - in.autopilot.heard_at_ns <= p.link_age_limit_ns;
  now.attitude_fresh = has_attitude(in) && in.now_ns - in.attitude.exposed_at_ns <= p.attitude_age_limit_ns;
  now.ground_seen = height_seen;
  now.images_fresh = images;
  now.ground_lost_long =
      !now.ground_seen && s.ground_seen_at_ns != kNever && in.now_ns - s.ground_seen_at_ns > p.ground_hold_limit_ns;
  now.setpoint_finite = finite;
  now.deadlines_missed = in.deadlines_missed;
  const bool watching = s.mission.phase == MissionPhase::kWatch;
  now.taken_away = watching && s.mission.early_end == EarlyEnd::kModeTaken;
  now.only_watching = watching && !now.taken_away;
  return now;
}

/// Level specific force plus gravity: what the vehicle accelerates with, along the heading and to its right.
LevelVelocity accel_level(const ControlInput& in) noexcept {
  if (!has_attitude(in) || !in.accel_present) return {};
  const Euler e = euler_from_quat(attitude_of(in));
  const Vec3 level = quat_from_euler({e.roll_rad, e.pitch_rad, 0.f}) *
                     Vec3(in.accel_body_mps2[0], in.accel_body_mps2[1], in.accel_body_mps2[2]);
  return {level.x(), level.y()};
}

void estimate_velocity(const ControlParams& p, const ControlInput& in, const Intention& intention,
                       ControlState& s) noexcept {
  predict(p.velocity_filter, accel_level(in), has_attitude(in) ? in.attitude.rate_body_radps[2] : 0.f, in.now_ns,
          s.velocity);
  if (intention.velocity_source < 0) return;
  correct(p.velocity_filter, {intention.velocity_forward_mps, intention.velocity_right_mps},
          intention.velocity_exposed_at_ns, in.now_ns, s.velocity);
  if (s.velocity.last_exposed_at_ns != intention.velocity_exposed_at_ns) return;  // not newer than what it rests on
  const ArbiterRow& row = p.arbiter.rows[static_cast<std::size_t>(intention.velocity_source)];
  s.velocity_until_ns = s.velocity.last_exposed_at_ns + std::min(row.age_limit_ns, p.velocity_filter.max_age_ns);
}

/// The velocity is known while neither the filter nor the arbiter finds the last cue of it too old.
bool velocity_known(const ControlParams& p, const ControlInput& in, const ControlState& s) noexcept {
  return known(p.velocity_filter, s.velocity, in.now_ns) && in.now_ns <= s.velocity_until_ns;
}

bool velocity_held(const ControlParams& p, const ControlInput& in, const ControlState& s) noexcept {
  return p.velocity_hold.hold != VelocityHold::kOff && velocity_known(p, in, s);
}

/// The velocity held rests on a cue that may be gone by now: its age counts all the same.
void rest_on_velocity(const ControlState& s, Intention& intention) noexcept {
  const TimeNs exposed_at_ns = s.velocity.last_exposed_at_ns;
  intention.usable_until_ns = std::min(intention.usable_until_ns, s.velocity_until_ns);
  if (intention.oldest_exposed_at_ns == kNever || exposed_at_ns < intention.oldest_exposed_at_ns)
    intention.oldest_exposed_at_ns = exposed_at_ns;
}

/// Carries height and velocity forward and corrects them by what was seen. True if a height is known now.
bool estimate(const ControlParams& p, const ControlInput& in, const Intention& intention, ControlState& s) noexcept {
  predict(p.height_filter, accel_up(in), in.now_ns, s.height);
  estimate_velocity(p, in, intention, s);
  const bool seen = intention.height_source >= 0;
  if (seen) correct(p.height_filter, intention.height_m, intention.height_exposed_at_ns, in.now_ns, s.height);
  float barometric_m = 0;
  const bool pressed = barometer_step(p.barometer, in.pressure_hpa, !in.autopilot.armed, seen, s.height.height_m,
                                      s.barometer, barometric_m);
  if (!seen && pressed) correct(p.height_filter, barometric_m, in.now_ns, in.now_ns, s.height);
  if (seen || pressed) s.ground_seen_at_ns = in.now_ns;
  return seen || pressed;
}

/// The height to hold: the leg's, or where the behaviours' wish to climb moves it.
float target_height(const ControlParams& p, const Intention& intention, const MissionWish& wish, float dt_s,
                    const ControlState& s) noexcept {
  if (!wish.behaviours_climb || !s.altitude_hold.engaged) return wish.target_m;
  const float climb_mps =
      intention.climb_source >= 0 ? intention.climb_mps + intention.climb_1ps * s.height.height_m : 0.f;
  return std::clamp(s.altitude_hold.setpoint_m + climb_mps * dt_s, p.min_height_m, p.max_height_m);
}

/// Yaw rate: the behaviours' sum and the sticks; while there is neither, back to the heading held, if one is to be
/// held.
float wanted_yaw_rate(const ControlParams& p, const ControlInput& in, const Intention& intention,
                      const MissionWish& wish, ControlState& s) noexcept {
  const float asked = (wish.steer ? intention.heading_rate_radps : 0.f) + wish.yaw_rate_radps;
  const bool steered = (wish.steer && intention.steered) || wish.yaw_rate_radps != 0.f;
  if (!p.hold_heading || steered || !has_attitude(in)) {
    s.holding_yaw = false;
    return asked;
  }
  const float yaw_rad = euler_from_quat(attitude_of(in)).yaw_rad;
  if (!s.holding_yaw) s.held_yaw_rad = yaw_rad, s.holding_yaw = true;
  constexpr float kHeadingGain_1ps = 0.8f;
  return kHeadingGain_1ps * std::remainder(s.held_yaw_rad - yaw_rad, 2 * std::numbers::pi_v<float>);
}

constexpr DurationNs kLongestBrake = 1 * kSecond;  // blind: any longer and a vehicle that stood would back away

/// Notes an avoid. One that comes back before it was away for the hold time, or for a brake's length, is no new one.
void hear_avoid(const ControlParams& p, const ControlInput& in, const Intention& intention, ControlState& s) noexcept {
  if (!intention.avoid) return;
  const DurationNs away_ns = std::max(from_seconds(static_cast<double>(p.avoid_hold_s)), kLongestBrake);
  if (s.avoid_raised_at_ns == kNever || in.now_ns - s.avoid_heard_at_ns >= away_ns) s.avoid_raised_at_ns = in.now_ns;
  s.avoid_heard_at_ns = in.now_ns;
}

/// From an avoid on until its hold time is over.
bool avoiding(const ControlParams& p, const ControlInput& in, const ControlState& s) noexcept {
  if (s.avoid_heard_at_ns == kNever) return false;
  const DurationNs since_ns = in.now_ns - s.avoid_heard_at_ns;
  return since_ns <= 0 || since_ns < from_seconds(static_cast<double>(p.avoid_hold_s));
}

/// Pitch: what holds the velocity, the behaviours' wish and the stick. While avoiding nothing pitches forward, and
/// where no held velocity brakes, a short nose-up does.
float wanted_pitch(const ControlParams& p, const ControlInput& in, const Intention& intention, const MissionWish& wish,
                   float hold_rad, const ControlState& s) noexcept {
  const float wish_rad = wish.steer ? intention.pitch_rad : 0.f;
  if (!avoiding(p, in, s)) return hold_rad + wish_rad + wish.pitch_rad;
  const bool forward_held = p.velocity_hold.hold == VelocityHold::kBoth && velocity_known(p, in, s);
  const bool brake =
      wish.steer && !forward_held && s.avoid_raised_at_ns != kNever && in.now_ns - s.avoid_raised_at_ns < kLongestBrake;
  return hold_rad + std::max({0.f, wish_rad, brake ? p.avoid_brake_rad : 0.f});
}

/// While somebody else had the vehicle nothing may be held from before: holds begin where it is now. An avoid raised
/// while the pilot flew brakes from the takeover on.
void forget_holds(FlightMode last_mode, ControlState& s) noexcept {
  if (last_mode != FlightMode::kManual && last_mode != FlightMode::kFailsafe && last_mode != FlightMode::kDisarmed)
    return;
  s.altitude_hold.engaged = s.holding_yaw = false;
  s.velocity_hold = VelocityHoldState{};
  if (last_mode == FlightMode::kManual) s.avoid_raised_at_ns = kNever;
}

/// The altitude hold with the thrust that carries the vehicle as the autopilot says, or as it was learned.
AltitudeHoldParams altitude_hold_of(const ControlParams& p, const ControlInput& in, const ControlState& s) noexcept {
  AltitudeHoldParams hold = p.altitude_hold;
  const float share = in.autopilot.semantics.learn_hover ? s.hover.share : in.autopilot.semantics.hover_share;
  if (share > 0.f) hold.full_thrust_n = hold.mass_kg * kGravity_mps2 / share;
  return hold;
}

void learn_hover(const ControlInput& in, const MissionWish& wish, ControlState& s) noexcept {
  const AutopilotSemantics& autopilot = in.autopilot.semantics;
  if (!autopilot.learn_hover) return;
  constexpr float kClear_m = 0.12f, kWellAbove_m = 0.1f;
  const float clearance_m = s.height.height_m - s.mission.ground_height_m;
  HoverShareInput seen{autopilot.hover_share, s.sent.thrust};
  seen.force_up_mps2 = in.accel_present ? -in.accel_body_mps2[2] : 0.f;
  seen.airborne = in.autopilot.armed && wish.rotors && clearance_m > kClear_m;
  seen.asked_up = in.autopilot.armed && wish.rotors && s.mode.mode == FlightMode::kBehaviour &&
                  s.altitude_hold.engaged && s.altitude_hold.setpoint_m - s.height.height_m > kWellAbove_m;
  hover_share_step(seen, in.dt_s, s.hover);
}

/// The thrust field that keeps the height.
float hovering_field(const ControlParams& p, const ControlInput& in, const ControlState& s) noexcept {
  if (in.autopilot.semantics.vertical == VerticalChannel::kClimbRate) return climb_field(in.autopilot.semantics, 0.f);
  return hover_thrust(altitude_hold_of(p, in, s), cos_tilt(in));
}

/// The thrust field of a gentle descent.
float sinking_field(const ControlParams& p, const ControlInput& in, const ControlState& s, float cos_tilt) noexcept {
  if (in.autopilot.semantics.vertical == VerticalChannel::kClimbRate)
    return climb_field(in.autopilot.semantics, -p.failsafe_sink_mps);
  return p.failsafe_thrust_share * hover_thrust(altitude_hold_of(p, in, s), cos_tilt);
}

/// The thrust field that brings the vehicle to the height wanted.
float height_field(const ControlParams& p, const ControlInput& in, float target_m, ControlState& s) noexcept {
  if (in.autopilot.semantics.vertical == VerticalChannel::kClimbRate)
    return climb_field(in.autopilot.semantics,
                       climb_hold_step(p.altitude_hold, target_m, s.height.height_m, in.dt_s, s.altitude_hold));
  return altitude_hold_step(altitude_hold_of(p, in, s), target_m, s.height.height_m, s.height.climb_rate_mps,
                            cos_tilt(in), in.dt_s, s.altitude_hold);
}

/// What behaviours and mission together want, before limits and mode.
Setpoint wanted_setpoint(const ControlParams& p, const ControlInput& in, const Intention& intention,
                         const MissionWish& wish, ControlState& s) noexcept {
  Setpoint wanted;
  hear_avoid(p, in, intention, s);
  if (!wish.rotors) {
    s.altitude_hold.engaged = s.holding_yaw = false;
    s.velocity_hold = VelocityHoldState{};
    return wanted;
  }
  const float forward_mps = avoiding(p, in, s) ? 0.f : wish.forward_mps;
  const bool moving = velocity_known(p, in, s);
  const Tilt tilt = velocity_hold_step(p.velocity_hold, forward_mps, moving, s.velocity.velocity_mps,
                                       s.sent.yaw_rate_radps, in.dt_s, s.velocity_hold);
  wanted.roll_rad = tilt.roll_rad + wish.roll_rad;
  wanted.pitch_rad = wanted_pitch(p, in, intention, wish, tilt.pitch_rad, s);
  wanted.yaw_rate_radps = wanted_yaw_rate(p, in, intention, wish, s);
  wanted.thrust = height_field(p, in, target_height(p, intention, wish, in.dt_s, s), s);
  return wanted;
}

/// The mode's own word: what goes out instead of, or as, the wanted setpoint.
Setpoint by_mode(const ControlParams& p, const ControlInput& in, const ControlState& s,
                 const Setpoint& wanted) noexcept {
  Setpoint neutral;
  switch (s.mode.mode) {
    case FlightMode::kBehaviour:
      return wanted;
    case FlightMode::kHold:  // who holds climb rates holds the height better than our accelerometer alone
      neutral.thrust =
          in.autopilot.semantics.vertical == VerticalChannel::kClimbRate ? hovering_field(p, in, s) : wanted.thrust;
      return neutral;
    case FlightMode::kManual:
      neutral.thrust = hovering_field(p, in, s);
      return neutral;
    case FlightMode::kFailsafe:
      neutral.thrust = p.failsafe_action == FailsafeAction::kStopStream ? hovering_field(p, in, s)
                                                                        : sinking_field(p, in, s, cos_tilt(in));
      return neutral;
    case FlightMode::kDisarmed:
      break;
  }
  return neutral;
}

/// The heading of the setpoint: the vehicle's own, or, for an autopilot that is told where to point, the one commanded
/// so far turned on by the yaw rate. It never runs far ahead of a vehicle that does not follow.
float heading_of(const ControlInput& in, ControlState& s) noexcept {
  if (!has_attitude(in)) return s.heading_rad = s.heading_held ? s.heading_before_rad : 0.f;
  const float yaw_rad = euler_from_quat(attitude_of(in)).yaw_rad;
  const bool commanded = in.autopilot.semantics.heading_by_angle && in.autopilot.armed && in.autopilot.follows;
  if (!commanded || !s.heading_held) {
    s.heading_held = commanded;
    return s.heading_rad = yaw_rad;
  }
  constexpr float kFurthestAhead_rad = 0.5f, kTurn = 2 * std::numbers::pi_v<float>;
  const float ahead_rad = std::remainder(s.heading_before_rad + s.sent.yaw_rate_radps * in.dt_s - yaw_rad, kTurn);
  s.heading_rad = yaw_rad + std::clamp(ahead_rad, -kFurthestAhead_rad, kFurthestAhead_rad);
  return s.heading_rad;
}

/// The stream ends with level setpoints: an autopilot flies the last one on until it notices (PX4 for COM_OF_LOSS_T,
/// ArduCopter for up to three seconds).
bool silent(const ControlParams& p, const ControlInput& in, ControlState& s) noexcept {
  constexpr DurationNs kLastWords = 140 * kMillisecond;  // three setpoints at 20 Hz
  if (s.mode.mode != FlightMode::kFailsafe || p.failsafe_action != FailsafeAction::kStopStream) {
    s.stopping_since_ns = kNever;
    return false;
  }
  if (s.stopping_since_ns == kNever) s.stopping_since_ns = in.now_ns;
  return in.now_ns - s.stopping_since_ns >= kLastWords;
}

/// Through the limits, from the last setpoint sent, into the command. Whatever is not the behaviours' own is level at
/// once.
void put_setpoint(const ControlParams& p, const ControlInput& in, const Setpoint& chosen, ControlState& s,
                  Command& c) noexcept {
  s.sent = s.sent_before;
  if (s.mode.mode != FlightMode::kBehaviour) level(s.sent);
  if (!limit(p.limits, chosen, in.dt_s, s.sent)) s.sent = Setpoint{};  // cannot happen: neutral is finite
  const Quat q = quat_from_euler({s.sent.roll_rad, s.sent.pitch_rad, heading_of(in, s)});
  c.q_ned_body = {q.w(), q.x(), q.y(), q.z()};
  c.yaw_rate_radps = s.sent.yaw_rate_radps;
  c.thrust = s.sent.thrust;
  c.mode = s.mode.mode;
  c.reason = s.mode.reason;
  const bool not_ours = in.autopilot.heard_at_ns == kNever || s.mission.phase == MissionPhase::kBroken ||
                        s.mission.phase == MissionPhase::kWatch;
  const bool stopped = silent(p, in, s);
  const bool left = s.mode.mode == FlightMode::kManual && in.autopilot.semantics.silent_when_left;
  c.sent = !not_ours && !stopped && !left;
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
  put_setpoint(p, in, by_mode(p, in, s, wanted), s, out.command);
  out.command.exposed_at_ns = kNever;
  out.command.cue_source = -1;
  out.command.refused = static_cast<std::uint8_t>(refusal);
}

ControlOutput control_step(const ControlParams& p, const ControlInput& in, ControlState& s) noexcept {
  Intention intention = arbitrate(p.arbiter, in.cues, in.now_ns);
  forget_holds(s.mode.mode, s);
  const bool height_seen = estimate(p, in, intention, s);
  if (velocity_held(p, in, s)) rest_on_velocity(s, intention);
  const MissionWish wish = mission_step(
      p.mission,
      {in.now_ns, in.autopilot.armed, in.autopilot.follows, height_seen, s.height.height_m, s.height.climb_rate_mps,
       in.stop_requested, in.autopilot.heard_at_ns != kNever, in.may_arm, in.autopilot.semantics.silent_when_left},
      s.mission);
  learn_hover(in, wish, s);
  const Setpoint wanted = wanted_setpoint(p, in, intention, wish, s);
  s.sent_before = s.sent;
  s.heading_before_rad = s.heading_rad;
  Setpoint probe = s.sent;
  const bool finite = limit(p.limits, wanted, in.dt_s, probe);
  flight_mode_step(assess(p, in, height_seen, intention.images, s, finite), s.mode);

  const bool standing = !wish.rotors && s.mode.mode != FlightMode::kManual;
  const Setpoint chosen = standing ? Setpoint{} : by_mode(p, in, s, wanted);
  ControlOutput out;
  Command& c = out.command;
  put_setpoint(p, in, chosen, s, c);
  if (!standing) put_age_limits(p, in, intention, s.mode.mode, out);
  c.exposed_at_ns = standing ? kNever : intention.oldest_exposed_at_ns;  // standing rests on nothing
  c.cue_source = intention.height_source;
  c.height_setpoint_m = wish.rotors ? s.altitude_hold.setpoint_m : 0.f;
  c.height_m = s.height.height_m;
  c.climb_rate_mps = s.height.climb_rate_mps;
  if (velocity_known(p, in, s)) {
    c.velocity_forward_mps = s.velocity.velocity_mps.forward;
    c.velocity_right_mps = s.velocity.velocity_mps.right;
    c.velocity_held = velocity_held(p, in, s) ? 1 : 0;
  }
  c.avoid = intention.avoid ? 1 : 0;
  c.mission_phase = static_cast<std::uint8_t>(s.mission.phase);
  const bool arming = wish.armed && s.mission.phase == MissionPhase::kArm;
  out.ask_follow = arming && !in.autopilot.follows;
  out.ask_arm = arming && !in.autopilot.armed;
  out.ask_disarm = wish.disarm && in.autopilot.armed;
  if (wish.rotors) out.neutral_thrust = sinking_field(p, in, s, 1.f);
  return out;
}

}  // namespace wasp::control
