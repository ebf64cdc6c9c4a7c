// The whole control path as one pure function: whatever comes in, what goes out is finite and within limits.
#include "control/control_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace wasp::control {
namespace {

ControlParams params() {
  ControlParams p;
  p.arbiter.behaviour_count = 2;
  p.arbiter.rows[0].height_rank = 0;
  p.arbiter.rows[1].height_rank = 1;
  p.arbiter.rows[1].heading_weight = 1;
  p.arbiter.rows[1].pitch_weight = 1;
  p.mission.leg_count = 1;
  p.mission.legs[0] = {0.5f, 60.f};
  return p;
}

ControlInput good_input(TimeNs now_ns) {
  ControlInput in;
  in.now_ns = now_ns;
  in.cues.present[0] = true;
  in.cues.cues[0].exposed_at_ns = now_ns - 40 * kMillisecond;
  in.cues.cues[0].body.validity = Validity::kValid;
  in.cues.cues[0].body.has_height = 1;
  in.cues.cues[0].body.height_m = 0.5f;
  in.attitude_present = true;
  in.attitude.exposed_at_ns = now_ns - 5 * kMillisecond;
  in.accel_present = true;
  in.accel_body_mps2 = {0, 0, -9.80665f};
  in.autopilot = {now_ns - 5 * kMillisecond, true, true, {}};
  return in;
}

/// The state after a tick on the ground, disarmed, as every flight begins.
ControlState on_the_ground(const ControlParams& p) {
  ControlState state;
  ControlInput in = good_input(10 * kMillisecond);
  in.autopilot.armed = in.autopilot.follows = false;
  control_step(p, in, state);
  return state;
}

TEST(ControlStep, AVehicleFoundArmedIsNotAdopted) {
  ControlState state;
  for (int i = 1; i < 20; ++i) {
    const ControlOutput out = control_step(params(), good_input(i * 50 * kMillisecond), state);
    EXPECT_EQ(out.command.sent, 0);  // it may be in the air: no command of ours, not even a neutral one
    EXPECT_FALSE(out.ask_arm || out.ask_disarm);
  }
}

/// A tick in flight with the behaviour commanding.
ControlOutput in_flight(const ControlParams& p, ControlInput& in, ControlState& state) {
  state = on_the_ground(p);
  ControlOutput out;
  for (int i = 1; i < 40; ++i) {
    in = good_input(i * 50 * kMillisecond);
    in.autopilot.armed = in.autopilot.follows = i > 4;
    out = control_step(p, in, state);
  }
  return out;
}

TEST(ControlStep, ACommandSaysUntilWhenItMayGoOut) {
  ControlInput in;
  ControlState state;
  const ControlParams p = params();
  const ControlOutput out = in_flight(p, in, state);
  ASSERT_EQ(out.command.mode, FlightMode::kBehaviour);
  const TimeNs cue_until = in.cues.cues[0].exposed_at_ns + p.arbiter.rows[0].age_limit_ns;
  const TimeNs attitude_until = in.attitude.exposed_at_ns + p.attitude_age_limit_ns;
  EXPECT_EQ(out.cue_until_ns, cue_until);
  EXPECT_EQ(out.attitude_until_ns, attitude_until);
  EXPECT_EQ(refusal_at(out, std::min(cue_until, attitude_until)), Refusal::kNone);
  EXPECT_EQ(refusal_at(out, attitude_until + 1), Refusal::kAttitudeTooOld);
  ControlOutput cue_only = out;
  cue_only.attitude_until_ns = kForever;
  EXPECT_EQ(refusal_at(cue_only, cue_until + 1), Refusal::kCueTooOld);
}

TEST(ControlStep, WhatIsSentWhileStandingRestsOnNoEvidence) {
  const ControlParams p = params();
  ControlState state = on_the_ground(p);
  const ControlInput in = good_input(50 * kMillisecond);
  const ControlOutput out = control_step(p, in, state);
  EXPECT_EQ(out.command.sent, 1);
  EXPECT_EQ(out.command.thrust, 0.f);
  EXPECT_EQ(out.command.exposed_at_ns, kNever);
  EXPECT_EQ(out.cue_until_ns, kForever);  // so no age of a cue can refuse it either
}

TEST(ControlStep, ARefusedCommandBecomesHoldOrFailsafeWithinTheLimits) {
  for (const Refusal refusal : {Refusal::kCueTooOld, Refusal::kAttitudeTooOld}) {
    ControlInput in;
    ControlState state;
    ControlParams p = params();
    ControlOutput out = in_flight(p, in, state);
    const float thrust = out.command.thrust;
    refuse(p, in, refusal, state, out);
    EXPECT_EQ(out.command.mode, refusal == Refusal::kCueTooOld ? FlightMode::kHold : FlightMode::kFailsafe);
    EXPECT_EQ(out.command.reason, ModeReason::kTooOld);
    EXPECT_EQ(out.command.refused, static_cast<std::uint8_t>(refusal));
    EXPECT_EQ(out.command.exposed_at_ns, kNever);
    EXPECT_EQ(out.command.sent, 1);
    EXPECT_NEAR(out.command.thrust, thrust, p.limits.max_thrust_rate_1ps * in.dt_s + 1e-6f);
    p.failsafe_action = FailsafeAction::kStopStream;
    out.command.sent = 1;
    refuse(p, in, refusal, state, out);
    EXPECT_EQ(out.command.sent, 1) << "the stream ends with level setpoints";
    EXPECT_NEAR(out.command.q_ned_body[1], 0, 1e-6);
    in.now_ns += 150 * kMillisecond;
    refuse(p, in, refusal, state, out);
    EXPECT_EQ(out.command.sent, refusal == Refusal::kCueTooOld ? 1 : 0);
  }
}

TEST(ControlStep, HoldAndFailsafeRestOnNoCue) {
  ControlInput in;
  ControlState state;
  const ControlParams p = params();
  in_flight(p, in, state);
  in.now_ns += 50 * kMillisecond;
  in.cues.present.fill(false);
  const ControlOutput out = control_step(p, in, state);
  EXPECT_EQ(out.command.mode, FlightMode::kHold);
  EXPECT_EQ(out.cue_until_ns, kForever);
  EXPECT_NE(out.attitude_until_ns, kForever);
}

/// Holds the velocity of behaviour 1, whose cues live 100 ms; the last one says 1 m/s forward and is `age_ns` old.
ControlOutput with_velocity_aged(DurationNs age_ns, ControlInput& in, ControlState& state) {
  ControlParams p = params();
  p.arbiter.rows[1].velocity_rank = 0;
  p.arbiter.rows[1].age_limit_ns = 100 * kMillisecond;
  p.velocity_hold.hold = VelocityHold::kBoth;
  in_flight(p, in, state);
  in.cues.present[1] = true;
  Cue& cue = in.cues.cues[1];
  cue.body.validity = Validity::kValid;
  cue.body.has_velocity = 1;
  cue.body.velocity_forward_mps = 1.f;
  const auto tick = [&] {
    in.now_ns += 10 * kMillisecond;
    in.cues.cues[0].exposed_at_ns = in.attitude.exposed_at_ns = in.autopilot.heard_at_ns = in.now_ns;
    return control_step(p, in, state);
  };
  for (int i = 0; i < 30; ++i) {
    cue.exposed_at_ns = in.now_ns;
    tick();
  }
  ControlOutput out;
  while (in.now_ns - cue.exposed_at_ns < age_ns) out = tick();
  return out;
}

TEST(ControlStep, AVelocityIsHeldNoLongerThanItsSourceMayBeUsed) {
  ControlInput in;
  ControlState state;
  const ControlOutput fresh = with_velocity_aged(90 * kMillisecond, in, state);
  EXPECT_EQ(fresh.command.velocity_held, 1);
  EXPECT_GT(fresh.command.q_ned_body[2], 0.03f);  // brakes
  ControlInput later;
  ControlState old;
  const ControlOutput out = with_velocity_aged(150 * kMillisecond, later, old);
  EXPECT_EQ(out.command.mode, FlightMode::kBehaviour);
  EXPECT_EQ(out.command.velocity_held, 0);
  EXPECT_EQ(out.command.velocity_forward_mps, 0.f);
  EXPECT_LT(out.command.q_ned_body[2], fresh.command.q_ned_body[2]);
  EXPECT_NEAR(out.command.q_ned_body[2], 0.f, 1e-3f);  // level
  EXPECT_NEAR(out.command.q_ned_body[1], 0.f, 1e-3f);
}

TEST(ControlStep, AHeldVelocitysAgeIsAskedAgainRightBeforeTheWriteThoughItsSourceIsBlindByNow) {
  ControlInput in;
  ControlState state;
  with_velocity_aged(50 * kMillisecond, in, state);
  ControlParams p = params();
  p.arbiter.rows[1].velocity_rank = 0;
  p.arbiter.rows[1].heading_weight = p.arbiter.rows[1].pitch_weight = 0;
  p.velocity_hold.hold = VelocityHold::kBoth;
  in.cues.cues[1].body.validity = Validity::kBlind;
  in.now_ns += 10 * kMillisecond;
  in.cues.cues[0].exposed_at_ns = in.attitude.exposed_at_ns = in.now_ns;
  const ControlOutput out = control_step(p, in, state);
  ASSERT_EQ(out.command.velocity_held, 1);
  EXPECT_EQ(out.cue_until_ns, in.cues.cues[1].exposed_at_ns + 100 * kMillisecond);
  EXPECT_EQ(out.command.exposed_at_ns, in.cues.cues[1].exposed_at_ns);
  EXPECT_EQ(refusal_at(out, out.cue_until_ns), Refusal::kNone);
  EXPECT_EQ(refusal_at(out, out.cue_until_ns + 1), Refusal::kCueTooOld);
  p.velocity_hold.hold = VelocityHold::kOff;  // not rested on: the height's age alone counts
  ControlState other = state;
  EXPECT_EQ(control_step(p, in, other).cue_until_ns, in.cues.cues[0].exposed_at_ns + p.arbiter.rows[0].age_limit_ns);
}

TEST(ControlStep, NothingIsHeldFromTheTimeInWhichThePilotFlew) {
  ControlParams p = params();
  p.arbiter.rows[1] = {.velocity_rank = 0, .climb_rank = 0};
  p.velocity_hold.hold = VelocityHold::kBoth;
  p.hold_heading = true;
  p.mission.legs[0].behaviours_climb = true;
  p.mission.legs[0].forward_mps = 2.f;
  ControlInput in;
  ControlState state;
  in_flight(p, in, state);
  const auto tick = [&](TimeNs now_ns, bool follows, float yaw_rad) {
    in = good_input(now_ns);
    in.autopilot.follows = follows;
    in.attitude.q_ned_body = {std::cos(yaw_rad / 2), 0, 0, std::sin(yaw_rad / 2)};
    in.cues.present[1] = true;
    Cue& cue = in.cues.cues[1];
    cue.exposed_at_ns = in.now_ns - 40 * kMillisecond;
    cue.body.validity = Validity::kValid;
    cue.body.has_climb = cue.body.has_velocity = 1;
    cue.body.climb_mps = 1.f;
    return control_step(p, in, state);
  };
  TimeNs t = in.now_ns;
  for (int i = 0; i < 20; ++i) tick(t += 50 * kMillisecond, true, 0.f);
  ASSERT_GT(state.altitude_hold.setpoint_m, 0.7f);  // in wasp's hands the wish moves the setpoint
  ASSERT_GT(state.velocity_hold.integral_mps2.forward, 0.1f);
  for (int i = 0; i < 200; ++i) {
    const ControlOutput out = tick(t += 50 * kMillisecond, false, 1.f);
    ASSERT_EQ(out.command.mode, FlightMode::kManual);
  }
  const ControlOutput out = tick(t += 50 * kMillisecond, true, 1.f);
  EXPECT_EQ(out.command.mode, FlightMode::kBehaviour);
  EXPECT_LT(std::fabs(out.command.height_setpoint_m - out.command.height_m), 0.1f);
  EXPECT_LT(std::fabs(state.altitude_hold.pid.integral), 0.01f);
  EXPECT_LT(state.velocity_hold.integral_mps2.forward, 0.01f);
  EXPECT_LT(state.velocity_hold.setpoint_mps, 0.05f);
  EXPECT_NEAR(out.command.yaw_rate_radps, 0.f, 1e-3f);  // not back to the heading of before
}

TEST(ControlStep, AFailsafeLeavesNoHoldBehind) {
  const ControlParams p = params();
  ControlInput in;
  ControlState state;
  in_flight(p, in, state);
  state.altitude_hold.setpoint_m = 3.f;
  for (const bool attitude : {false, true}) {
    in.now_ns += 50 * kMillisecond;
    in.cues.cues[0].exposed_at_ns = in.attitude.exposed_at_ns = in.autopilot.heard_at_ns = in.now_ns;
    in.attitude_present = attitude;
    control_step(p, in, state);
    EXPECT_EQ(state.mode.mode, attitude ? FlightMode::kBehaviour : FlightMode::kFailsafe);
  }
  EXPECT_LT(std::fabs(state.altitude_hold.setpoint_m - state.height.height_m), 0.1f);
}

/// A flight of behaviour 0 at height; behaviour 1 says what the test makes it say.
struct Avoiding : ::testing::Test {
  ControlParams p = params();
  ControlInput in;
  ControlState state;
  float velocity_mps = 0;
  bool velocity_seen = false, avoid = false, follows = true;
  Avoiding() {
    p.arbiter.rows[1] = {.velocity_rank = 0, .pitch_weight = 1};
    p.velocity_hold.hold = VelocityHold::kBoth;
    p.mission.legs[0].forward_mps = 1.f;
  }
  /// Pitch of the setpoint after `seconds` more [rad].
  float pitch_after(double seconds) {
    float pitch_rad = 0;
    for (int i = 0; i < std::lround(seconds / 0.05); ++i) {
      in = good_input(in.now_ns + 50 * kMillisecond);
      in.autopilot.follows = follows;
      in.cues.present[1] = true;
      Cue& cue = in.cues.cues[1];
      cue.exposed_at_ns = in.now_ns - 40 * kMillisecond;
      cue.body.validity = velocity_seen ? Validity::kValid : Validity::kBlind;
      cue.body.has_velocity = velocity_seen ? 1 : 0;
      cue.body.velocity_forward_mps = velocity_mps;
      cue.body.avoid = avoid ? 1 : 0;
      control_step(p, in, state);
      pitch_rad = state.sent.pitch_rad;
    }
    return pitch_rad;
  }
};

TEST_F(Avoiding, WithoutAVelocityPitchesUpForASecondAndIsLevelThen) {
  in_flight(p, in, state);
  EXPECT_NEAR(pitch_after(0.5), 0.f, 1e-4f);
  avoid = true;
  EXPECT_NEAR(pitch_after(0.2), p.avoid_brake_rad, 1e-4f);
  EXPECT_NEAR(pitch_after(0.8), p.avoid_brake_rad, 1e-4f);
  EXPECT_NEAR(pitch_after(0.2), 0.f, 1e-4f);
  EXPECT_NEAR(pitch_after(20.), 0.f, 1e-4f);  // still raised: never again backwards
  avoid = false;
  pitch_after(static_cast<double>(p.avoid_hold_s) + 0.1);
  avoid = true;
  EXPECT_NEAR(pitch_after(0.2), p.avoid_brake_rad, 1e-4f);  // a new one
}

TEST_F(Avoiding, AnAvoidThatFlickersBrakesOnce) {
  for (const float hold_s : {3.f, 0.f}) {
    p.avoid_hold_s = hold_s;
    in_flight(p, in, state);
    int ticks = 0;
    for (int i = 0; i < 200; ++i) {
      avoid = i % 3 == 0;
      if (pitch_after(0.05) > 0.01f) ++ticks;
    }
    EXPECT_GT(ticks, 3) << hold_s;
    EXPECT_LE(ticks, 22) << hold_s;  // a second, and the way back to level
  }
}

TEST_F(Avoiding, WithTheSidewaysHoldAloneItBrakesThoughTheVelocityIsKnown) {
  p.velocity_hold.hold = VelocityHold::kSideways;
  velocity_seen = true;
  velocity_mps = 1.f;
  in_flight(p, in, state);
  EXPECT_NEAR(pitch_after(1.), 0.f, 1e-4f);
  avoid = true;
  EXPECT_NEAR(pitch_after(0.5), p.avoid_brake_rad, 1e-4f);
  EXPECT_NEAR(pitch_after(0.7), 0.f, 1e-4f);
}

TEST_F(Avoiding, AHeldForwardVelocityBrakesAloneWhateverTheNoseUpIs) {
  std::array<float, 2> pitch{};
  for (const std::size_t i : {0u, 1u}) {
    p.avoid_brake_rad = i == 0 ? 0.f : 0.2f;
    velocity_seen = true;
    avoid = false;
    velocity_mps = 0.2f;
    in_flight(p, in, state);
    pitch_after(1.);
    avoid = true;
    pitch[i] = pitch_after(0.5);
  }
  EXPECT_GT(pitch[0], 0.02f);
  EXPECT_EQ(pitch[0], pitch[1]);
}

TEST_F(Avoiding, OneRaisedWhileThePilotFlewBrakesFromTheTakeoverOn) {
  in_flight(p, in, state);
  avoid = true;
  follows = false;
  EXPECT_NEAR(pitch_after(5.), 0.f, 1e-4f);
  follows = true;
  EXPECT_NEAR(pitch_after(0.5), p.avoid_brake_rad, 1e-4f);
  EXPECT_NEAR(pitch_after(1.), 0.f, 1e-4f);
}

TEST(ControlStep, NothingIsSentBeforeTheAutopilotWasHeard) {
  ControlState state;
  ControlInput in = good_input(50 * kMillisecond);
  in.autopilot = {};
  EXPECT_EQ(control_step(params(), in, state).command.sent, 0);
}

TEST(ControlStep, FliesWhenEverythingIsThere) {
  ControlState state = on_the_ground(params());
  ControlOutput out;
  for (int i = 1; i < 100; ++i) out = control_step(params(), good_input(i * 50 * kMillisecond), state);
  EXPECT_EQ(out.command.mode, FlightMode::kBehaviour);
  EXPECT_EQ(out.command.cue_source, 0);
  EXPECT_NEAR(out.command.thrust, 0.843f, 0.03f);  // near the weight: it is at its setpoint
  EXPECT_EQ(out.command.exposed_at_ns, 99 * 50 * kMillisecond - 40 * kMillisecond);
}

TEST(ControlStep, HoldsThenFailsafeWhenTheGroundIsLost) {
  const ControlParams p = params();
  ControlState state = on_the_ground(p);
  TimeNs t = 10 * kMillisecond;
  for (int i = 0; i < 60; ++i) control_step(p, good_input(t += 50 * kMillisecond), state);
  ControlOutput out;
  const TimeNs lost_at = t;
  while (t - lost_at < p.ground_hold_limit_ns + p.arbiter.rows[0].age_limit_ns + 200 * kMillisecond) {
    ControlInput in = good_input(t += 50 * kMillisecond);
    in.cues.cues[0].exposed_at_ns = lost_at;
    out = control_step(p, in, state);
    if (t - lost_at > p.arbiter.rows[0].age_limit_ns && t - lost_at <= p.ground_hold_limit_ns) {
      EXPECT_EQ(out.command.mode, FlightMode::kHold);
      EXPECT_EQ(out.command.cue_source, -1);
    }
  }
  EXPECT_EQ(out.command.mode, FlightMode::kFailsafe);
  EXPECT_LT(out.command.thrust, 0.843f);
  EXPECT_GT(out.command.thrust, 0.75f);
}

/// A flight that behaviour 1 leans and turns as far as the limits allow; `in` is of its last tick.
void lean(const ControlParams& p, ControlInput& in, ControlState& state) {
  in_flight(p, in, state);
  for (int i = 0; i < 40; ++i) {
    in = good_input(in.now_ns + 50 * kMillisecond);
    in.cues.present[1] = true;
    Cue& cue = in.cues.cues[1];
    cue.exposed_at_ns = in.now_ns - 40 * kMillisecond;
    cue.body.validity = Validity::kValid;
    cue.body.has_pitch = cue.body.has_heading_rate = 1;
    cue.body.pitch_rad = cue.body.heading_rate_radps = 1.f;
    control_step(p, in, state);
  }
}

TEST(ControlStep, EveryFallToHoldOrFailsafeIsLevelInOneTickWithinTheThrustsRate) {
  struct Fall {
    const char* what;
    FlightMode mode;
    void (*happens)(ControlInput&);
  };
  const Fall falls[] = {
      {"cues", FlightMode::kHold, [](ControlInput& in) { in.cues.present.fill(false); }},
      {"deadlines", FlightMode::kHold, [](ControlInput& in) { in.deadlines_missed = true; }},
      {"attitude", FlightMode::kFailsafe, [](ControlInput& in) { in.attitude_present = false; }},
      {"attitude not finite", FlightMode::kFailsafe,
       [](ControlInput& in) { in.attitude.q_ned_body[1] = std::numeric_limits<float>::quiet_NaN(); }},
      {"link", FlightMode::kFailsafe, [](ControlInput& in) { in.autopilot.heard_at_ns -= kSecond; }},
  };
  const ControlParams p = params();
  for (const Fall& fall : falls) {
    ControlInput in;
    ControlState state;
    lean(p, in, state);
    const Setpoint before = state.sent;
    ASSERT_GT(before.pitch_rad, 0.25f);
    ASSERT_GT(before.yaw_rate_radps, 0.7f);
    ControlInput lost = good_input(in.now_ns + 50 * kMillisecond);
    lost.cues = in.cues;
    for (Cue& cue : lost.cues.cues) cue.exposed_at_ns = lost.now_ns - 40 * kMillisecond;
    fall.happens(lost);
    const ControlOutput out = control_step(p, lost, state);
    EXPECT_EQ(out.command.mode, fall.mode) << fall.what;
    EXPECT_EQ(state.sent.pitch_rad, 0.f) << fall.what;
    EXPECT_EQ(out.command.q_ned_body[1], 0.f) << fall.what;
    EXPECT_EQ(out.command.q_ned_body[2], 0.f) << fall.what;
    EXPECT_EQ(out.command.yaw_rate_radps, 0.f) << fall.what;
    EXPECT_LE(std::fabs(out.command.thrust - before.thrust), p.limits.max_thrust_rate_1ps * in.dt_s + 1e-6f);
    EXPECT_GT(out.command.thrust, 0.6f) << fall.what;
  }
}

TEST(ControlStep, ABarometricHeightDoesNotKeepASightlessVehicleCruising) {
  ControlParams p = params();
  p.barometer.enabled = true;
  p.mission.legs[0].yaw_amplitude_radps = 1.f;  // a pilot's stick that would turn on
  ControlInput in;
  ControlState state;
  ControlOutput out;
  state = on_the_ground(p);
  for (int i = 1; i < 80; ++i) {
    in = good_input(i * 50 * kMillisecond);
    in.autopilot.armed = in.autopilot.follows = i > 4;
    in.pressure_hpa = 1000.f;
    out = control_step(p, in, state);
  }
  ASSERT_EQ(out.command.mode, FlightMode::kBehaviour);
  ASSERT_NE(out.command.yaw_rate_radps, 0.f);
  const TimeNs last_exposure_ns = in.cues.cues[0].exposed_at_ns;
  in.cues.cues[0].body.validity = Validity::kBlind;  // frames come, nothing is seen: the pilot flies on
  for (int i = 0; i < 40; ++i) {
    in.now_ns += 50 * kMillisecond;
    in.attitude.exposed_at_ns = in.autopilot.heard_at_ns = in.now_ns;
    if (i == 0) in.cues.cues[0].exposed_at_ns = in.now_ns - 40 * kMillisecond;
    out = control_step(p, in, state);
    const bool recent = in.now_ns - in.cues.cues[0].exposed_at_ns <= p.arbiter.rows[0].age_limit_ns;
    EXPECT_EQ(out.command.mode, recent ? FlightMode::kBehaviour : FlightMode::kHold) << i;
    if (!recent) {
      EXPECT_EQ(out.command.yaw_rate_radps, 0.f);
    }
  }
  EXPECT_GT(in.now_ns - last_exposure_ns, kSecond);
  EXPECT_EQ(out.command.mode, FlightMode::kHold);  // and the barometer holds the height: no failsafe
}

/// The first level setpoint after the last good exposure, with ticks that fall as unluckily as they can.
TEST(ControlStep, NeutralGoesOutWithin150MillisecondsOfTheLastGoodExposure) {
  const ControlParams p = params();
  for (DurationNs phase_ns = 0; phase_ns < 50 * kMillisecond; phase_ns += kMillisecond) {
    ControlInput in;
    ControlState state;
    lean(p, in, state);
    const TimeNs last_ns = in.now_ns - phase_ns;
    TimeNs level_at_ns = 0;
    for (int i = 1; i < 10 && level_at_ns == 0; ++i) {
      ControlInput next = good_input(in.now_ns + i * 50 * kMillisecond);
      next.cues = in.cues;
      for (Cue& cue : next.cues.cues) cue.exposed_at_ns = last_ns;
      if (control_step(p, next, state).command.q_ned_body[2] == 0.f) level_at_ns = next.now_ns;
    }
    ASSERT_NE(level_at_ns, 0);
    EXPECT_LE(level_at_ns - last_ns, 145 * kMillisecond);
  }
}

TEST(ControlStep, SilenceOfTheLinkIsAnsweredWithin300Milliseconds) {
  const ControlParams p = params();
  for (DurationNs phase_ns = 0; phase_ns < 50 * kMillisecond; phase_ns += kMillisecond) {
    ControlInput in;
    ControlState state;
    lean(p, in, state);
    const TimeNs last_ns = in.now_ns - phase_ns;
    TimeNs answered_at_ns = 0;
    for (int i = 1; i < 10 && answered_at_ns == 0; ++i) {
      ControlInput next = good_input(in.now_ns + i * 50 * kMillisecond);
      next.autopilot.heard_at_ns = last_ns;
      if (control_step(p, next, state).command.reason == ModeReason::kLinkLost) answered_at_ns = next.now_ns;
    }
    ASSERT_NE(answered_at_ns, 0);
    EXPECT_LE(answered_at_ns - last_ns, 290 * kMillisecond);
  }
}

TEST(ControlStep, TheWayBackFromLevelKeepsTheTiltRate) {
  const ControlParams p = params();
  ControlInput in;
  ControlState state;
  lean(p, in, state);
  ControlInput next = good_input(in.now_ns + 50 * kMillisecond);
  control_step(p, next, state);  // behaviour 1 is silent, but nothing fell: on its way by the rate
  EXPECT_GT(state.sent.pitch_rad, 0.1f);
  next = good_input(next.now_ns + 50 * kMillisecond);
  next.cues.present.fill(false);
  control_step(p, next, state);
  ASSERT_EQ(state.sent.pitch_rad, 0.f);
  next = good_input(next.now_ns + 50 * kMillisecond);
  next.cues.cues[1] = in.cues.cues[1];
  next.cues.present[1] = true;
  next.cues.cues[1].exposed_at_ns = next.now_ns - 40 * kMillisecond;
  control_step(p, next, state);
  EXPECT_EQ(state.mode.mode, FlightMode::kBehaviour);
  EXPECT_NEAR(state.sent.pitch_rad, p.limits.max_tilt_rate_radps * next.dt_s, 1e-4f);
}

TEST(ControlStep, StopStreamFailsafeSendsNothing) {
  ControlParams p = params();
  p.failsafe_action = FailsafeAction::kStopStream;
  ControlState state;
  ControlInput in = good_input(50 * kMillisecond);
  in.attitude_present = false;
  EXPECT_EQ(control_step(p, in, state).command.sent, 0);
}

/// A float of any bit pattern, so NaN, infinities and denormals come too.
float any_float(std::mt19937& random) {
  const auto bits = static_cast<std::uint32_t>(random());
  float f;
  std::memcpy(&f, &bits, sizeof f);
  return f;
}

TEST(ControlStep, PropertyNothingWildEverLeaves) {
  std::mt19937 random(2026);
  ControlParams p = params();
  ControlState state = on_the_ground(p);
  TimeNs t = 0;
  for (int i = 0; i < 50'000; ++i) {
    ControlInput in = good_input(t += 50 * kMillisecond);
    const auto chance = [&](unsigned n) { return random() % n == 0; };
    for (std::size_t b = 0; b < 2; ++b) {
      in.cues.present[b] = !chance(4);
      auto& body = in.cues.cues[b].body;
      body.validity = chance(5) ? Validity::kBlind : Validity::kValid;
      body.has_height = !chance(3);
      body.has_heading_rate = body.has_pitch = !chance(2);
      if (chance(3)) body.height_m = any_float(random);
      if (chance(3)) body.heading_rate_radps = any_float(random);
      if (chance(3)) body.pitch_rad = any_float(random);
      in.cues.cues[b].exposed_at_ns = chance(6) ? t - 10 * kSecond : t - 40 * kMillisecond;
    }
    if (chance(5)) in.accel_body_mps2[2] = any_float(random);
    for (float& q : in.attitude.q_ned_body)
      if (chance(20)) q = any_float(random);
    for (float& r : in.attitude.rate_body_radps)
      if (chance(9)) r = any_float(random);
    if (chance(9)) in.pressure_hpa = any_float(random);
    if (chance(7)) in.attitude_present = false;
    if (chance(9)) in.autopilot.follows = false;
    if (chance(50)) in.autopilot.armed = false;
    if (chance(300)) state = on_the_ground(p);
    const Command c = control_step(p, in, state).command;
    ASSERT_TRUE(std::isfinite(c.thrust) && c.thrust >= 0 && c.thrust <= 1) << i;
    ASSERT_TRUE(std::isfinite(c.yaw_rate_radps) && std::fabs(c.yaw_rate_radps) <= p.limits.max_yaw_rate_radps) << i;
    float norm = 0;
    for (const float q : c.q_ned_body) norm += q * q;
    ASSERT_NEAR(norm, 1.f, 1e-3f) << i;
    ASSERT_TRUE(std::isfinite(c.height_m) && std::isfinite(c.climb_rate_mps)) << i;
  }
}

}  // namespace
}  // namespace wasp::control
