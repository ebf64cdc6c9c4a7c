// The same control for other autopilots: climb rates in place of thrust, headings in place of yaw rates, a hover thrust
// that must be learned, and a mode that is somebody else's.
#include "types/autopilot_semantics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "control/control_step.h"
#include "types/frames.h"

namespace wasp::control {
namespace {

constexpr float kGravity_mps2 = 9.80665f;

/// A vehicle on virtual time that obeys at once what it is asked, except for its height, which the test sets.
class Bench {
 public:
  explicit Bench(const AutopilotSemantics& semantics) : semantics_(semantics) {
    params.arbiter.behaviour_count = 1;
    params.arbiter.rows[0].height_rank = 0;
    params.arbiter.rows[0].heading_weight = 1;
    params.mission.leg_count = 1;
    params.mission.legs[0] = {1.f, 60.f};
    params.failsafe_action = FailsafeAction::kStopStream;
  }

  ControlParams params;
  bool armed = false, follows = false, sees = true;
  float height_m = 0.2f, yaw_rad = 0, heading_wish_radps = 0, force_up_mps2 = kGravity_mps2;
  ControlOutput out;
  ControlState state;

  void tick(int n = 1) {
    for (int i = 0; i < n; ++i) {
      now_ns_ += 50 * kMillisecond;
      ControlInput in;
      in.now_ns = now_ns_;
      Cue& cue = in.cues.cues[0];
      in.cues.present[0] = true;
      if (sees) exposed_ns_ = now_ns_ - 40 * kMillisecond;
      cue.exposed_at_ns = exposed_ns_;
      cue.body.validity = Validity::kValid;
      cue.body.has_height = 1;
      cue.body.height_m = height_m;
      cue.body.has_heading_rate = 1;
      cue.body.heading_rate_radps = heading_wish_radps;
      in.attitude_present = true;
      in.attitude.exposed_at_ns = now_ns_ - 5 * kMillisecond;
      const Quat q = quat_from_euler({0, 0, yaw_rad});
      in.attitude.q_ned_body = {q.w(), q.x(), q.y(), q.z()};
      in.accel_present = true;
      in.accel_body_mps2 = {0, 0, -force_up_mps2};
      in.autopilot = {now_ns_ - 5 * kMillisecond, armed, follows, semantics_};
      out = control_step(params, in, state);
    }
  }
  /// On the first leg, at its height.
  void fly() {
    tick(3);
    ASSERT_TRUE(out.ask_follow);
    follows = true;
    tick();
    ASSERT_TRUE(out.ask_arm);
    armed = true;
    for (height_m = 0.2f; height_m < 1.f; height_m += 0.02f) tick();
    height_m = 1.f;
    tick(60);
    ASSERT_EQ(out.command.mode, FlightMode::kBehaviour);
  }
  [[nodiscard]] float commanded_yaw() const {
    const auto& q = out.command.q_ned_body;
    return euler_from_quat(Quat(q[0], q[1], q[2], q[3])).yaw_rad;
  }

 private:
  AutopilotSemantics semantics_;
  TimeNs now_ns_ = kSecond, exposed_ns_ = 0;
};

AutopilotSemantics copter() {
  AutopilotSemantics s;
  s.vertical = VerticalChannel::kClimbRate;
  s.climb_at_full_mps = 2.5f, s.sink_at_zero_mps = 1.5f;
  s.heading_by_angle = s.silent_when_left = true;
  s.heading_rate_used = false;
  return s;
}

AutopilotSemantics px4() {
  AutopilotSemantics s;
  s.hover_share = 0.5f;
  s.learn_hover = s.heading_by_angle = s.silent_when_left = true;
  return s;
}

TEST(ClimbRateAutopilot, IsAskedToHoldAtTheHeightAndToMoveTowardsIt) {
  Bench b(copter());
  ASSERT_NO_FATAL_FAILURE(b.fly());
  EXPECT_NEAR(b.out.command.thrust, 0.5f, 0.03f);
  b.height_m = 0.8f;
  b.tick(10);
  const float up = b.out.command.thrust;
  EXPECT_GT(up, 0.52f);
  EXPECT_LT(up, 0.5f + 0.5f * 0.8f / 2.5f + 1e-3f) << "twice max_climb_mps at most";
  b.height_m = 1.2f;
  b.tick(30);
  EXPECT_LT(b.out.command.thrust, 0.48f);
}

TEST(ClimbRateAutopilot, TakesOffByAPositiveClimbRateAndStandsWithoutOne) {
  Bench b(copter());
  b.tick(3);
  EXPECT_LE(b.out.command.thrust, 0.5f) << "standing: nothing that it would take off by";
  b.follows = true;
  b.tick();
  b.armed = true;
  b.tick(4);
  EXPECT_GT(b.out.command.thrust, 0.5f);
}

TEST(ClimbRateAutopilot, TheGuardiansNeutralSinksGently) {
  Bench b(copter());
  ASSERT_NO_FATAL_FAILURE(b.fly());
  EXPECT_NEAR(b.out.neutral_thrust, 0.5f - 0.5f * 0.3f / 1.5f, 1e-4f);
}

TEST(ThrustAutopilot, LearnsWhatCarriesTheVehicle) {
  Bench b(px4());
  ASSERT_NO_FATAL_FAILURE(b.fly());
  for (int i = 0; i < 200; ++i) {
    b.force_up_mps2 = kGravity_mps2 * b.out.command.thrust / 0.62f;  // a vehicle that hovers at 0.62
    b.tick();
  }
  EXPECT_NEAR(b.state.hover.share, 0.62f, 0.02f);
}

TEST(ThrustAutopilot, AsksForMoreWhileItDoesNotLeaveTheGround) {
  Bench b(px4());
  b.tick(3);
  b.follows = true;
  b.tick();
  b.armed = true;
  b.tick(100);
  EXPECT_GT(b.state.hover.share, 0.75f);
  EXPECT_GT(b.out.command.thrust, 0.75f);
  b.tick(400);
  EXPECT_LE(b.state.hover.share, 0.95f);
}

TEST(HeadingByAngle, StaysWhereItWasWhenTheVehicleDriftsAndTurnsOnAtTheRateAskedFor) {
  Bench b(px4());
  b.yaw_rad = 1.f;
  ASSERT_NO_FATAL_FAILURE(b.fly());
  EXPECT_NEAR(b.commanded_yaw(), 1.f, 1e-3f) << "the heading at home, whatever it is";
  b.yaw_rad = 1.2f;
  b.tick(20);
  EXPECT_NEAR(b.commanded_yaw(), 1.f, 1e-3f);
  b.yaw_rad = 1.f;
  b.heading_wish_radps = 0.3f;
  for (int i = 0; i < 60; ++i) {
    b.yaw_rad = b.commanded_yaw() - 0.1f;  // follows late
    b.tick();
  }
  EXPECT_NEAR(b.commanded_yaw(), 1.f + 0.3f * 3.f, 0.1f);
  EXPECT_NEAR(b.out.command.yaw_rate_radps, 0.3f, 1e-3f);
}

TEST(HeadingByAngle, NeverRunsFarAheadOfAVehicleThatDoesNotTurn) {
  Bench b(copter());
  ASSERT_NO_FATAL_FAILURE(b.fly());
  b.heading_wish_radps = 0.8f;
  b.tick(100);
  EXPECT_LE(b.commanded_yaw(), 0.51f);
}

TEST(TheModeIsTakenAway, NothingIsSentOrAskedAndTheMissionEnds) {
  for (const AutopilotSemantics& s : {px4(), copter()}) {
    Bench b(s);
    ASSERT_NO_FATAL_FAILURE(b.fly());
    EXPECT_EQ(b.out.command.sent, 1);
    b.follows = false;
    for (int i = 0; i < 40; ++i) {
      b.tick();
      EXPECT_EQ(b.out.command.sent, 0) << "from the very tick on";
      EXPECT_FALSE(b.out.ask_follow || b.out.ask_arm || b.out.ask_disarm);
    }
    EXPECT_EQ(b.out.command.mode, FlightMode::kManual);
    EXPECT_EQ(b.state.mission.early_end, EarlyEnd::kModeTaken);
    b.follows = true;  // given back: nobody asked for it, and nothing is commanded
    b.tick(20);
    EXPECT_EQ(b.out.command.sent, 0);
    b.armed = false;
    b.tick(40);
    EXPECT_EQ(b.state.mission.phase, MissionPhase::kBroken);
    EXPECT_EQ(b.state.mission.early_end, EarlyEnd::kModeTaken);
  }
}

TEST(NoEvidence, TheStreamStopsOnPurposeAndComesBackWithIt) {
  Bench b(copter());
  ASSERT_NO_FATAL_FAILURE(b.fly());
  b.sees = false;
  int sent = 0;
  for (int i = 0; i < 60; ++i) {
    b.tick();
    sent += b.out.command.sent;
  }
  EXPECT_EQ(b.out.command.mode, FlightMode::kFailsafe);
  EXPECT_EQ(b.out.command.sent, 0);
  EXPECT_LT(sent, 30) << "level for a second, then silence";
  b.sees = true;
  b.tick(5);
  EXPECT_EQ(b.out.command.sent, 1);
}

TEST(ThePilotArms, IsWaitedForWithoutLosingPatience) {
  Bench b(copter());
  b.params.mission.pilot_arms = true;
  b.params.mission.patience_s = 5;
  b.tick(20 * 30);
  EXPECT_EQ(b.state.mission.phase, MissionPhase::kArm);
  b.armed = b.follows = true;
  b.tick(3);
  EXPECT_GE(leg_of(b.state.mission.phase), 0);
}

}  // namespace
}  // namespace wasp::control
