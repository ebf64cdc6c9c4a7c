// The velocity filter and hold against a simple vehicle: level acceleration by tilt, linear drag, a camera that sees
// late.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>

#include "control/velocity_hold.h"

namespace wasp::control {
namespace {

constexpr float kDt_s = 0.05f;
constexpr TimeNs kDt_ns = 50 * kMillisecond;

/// A point mass flown through filter and hold; velocities are seen `delay` ticks late.
struct Flight {
  VelocityFilterParams filter;
  VelocityHoldParams hold{.hold = VelocityHold::kBoth};
  VelocityFilterState estimate;
  VelocityHoldState state;
  LevelVelocity truth, tilt_accel;
  float wind_mps2 = 0, accel_error_mps2 = 0, yaw_rate_radps = 0;
  int delay = 2;
  TimeNs now_ns = 0;
  std::deque<std::pair<TimeNs, LevelVelocity>> seen;

  void tick(float forward_mps, bool camera = true) {
    now_ns += kDt_ns;
    const LevelVelocity accel{tilt_accel.forward - 0.13f * truth.forward + wind_mps2,
                              tilt_accel.right - 0.13f * truth.right};
    truth = {truth.forward + accel.forward * kDt_s, truth.right + accel.right * kDt_s};
    const float turn = yaw_rate_radps * kDt_s;  // the frame turns under the velocity
    truth = {truth.forward + turn * truth.right, truth.right - turn * truth.forward};
    predict(filter, {accel.forward + accel_error_mps2, accel.right}, yaw_rate_radps, now_ns, estimate);
    if (camera) seen.push_back({now_ns, truth});
    if (static_cast<int>(seen.size()) > delay) {
      correct(filter, seen.front().second, seen.front().first, now_ns, estimate);
      seen.pop_front();
    }
    const Tilt t = velocity_hold_step(hold, forward_mps, known(filter, estimate, now_ns), estimate.velocity_mps,
                                      yaw_rate_radps, kDt_s, state);
    constexpr float kLag = kDt_s / 0.2f;  // the attitude follows in 0.2 s
    tilt_accel.forward += kLag * (-9.81f * std::tan(t.pitch_rad) - tilt_accel.forward);
    tilt_accel.right += kLag * (9.81f * std::tan(t.roll_rad) - tilt_accel.right);
  }
};

TEST(VelocityHold, ReachesTheSpeedAgainstWindAndDragWithoutMuchOvershoot) {
  Flight f;
  f.wind_mps2 = -0.3f;
  float most = 0;
  for (int i = 0; i < 300; ++i) f.tick(i < 20 ? 0.f : 1.f), most = std::fmax(most, f.truth.forward);
  EXPECT_NEAR(f.truth.forward, 1.f, 0.03f);
  EXPECT_LT(most, 1.25f);
}

TEST(VelocityHold, StopsASidewaysDrift) {
  Flight f;
  f.truth.right = 0.8f;
  for (int i = 0; i < 120; ++i) f.tick(0.f);
  EXPECT_NEAR(f.truth.right, 0.f, 0.05f);
}

TEST(VelocityHold, TheWayOverGroundFollowsATurnOfTheHeading) {
  Flight f;
  for (int i = 0; i < 100; ++i) f.tick(0.8f);
  f.yaw_rate_radps = 0.3f;
  float skid = 0;
  for (int i = 0; i < 60; ++i) f.tick(0.8f), skid = std::fmax(skid, std::fabs(f.truth.right));
  EXPECT_LT(skid, 0.08f);  // 0.14 without banking: ten degrees of drift
}

TEST(VelocityHold, BrakesWithoutARamp) {
  Flight f;
  for (int i = 0; i < 200; ++i) f.tick(1.2f);
  int ticks = 0;
  while (f.truth.forward > 0.1f && ticks < 200) f.tick(0.f), ++ticks;
  EXPECT_LT(ticks, 40);  // two seconds
}

TEST(VelocityHold, IsLevelWhileNobodyKnowsTheVelocity) {
  VelocityHoldState s;
  s.integral_mps2.forward = 0.5f;
  const Tilt t = velocity_hold_step({.hold = VelocityHold::kBoth}, 1.f, false, {}, 0.f, kDt_s, s);
  EXPECT_EQ(t.roll_rad, 0.f);
  EXPECT_EQ(t.pitch_rad, 0.f);
  EXPECT_EQ(s.integral_mps2.forward, 0.f);
}

TEST(VelocityFilter, FindsAnAccelerometersBias) {
  Flight f;
  f.accel_error_mps2 = 0.3f;
  for (int i = 0; i < 300; ++i) f.tick(0.5f);
  EXPECT_NEAR(f.estimate.velocity_mps.forward, f.truth.forward, 0.05f);
  EXPECT_NEAR(f.estimate.bias_mps2.forward, 0.3f, 0.1f);
}

TEST(VelocityFilter, ForgetsAfterItsAgeLimit) {
  Flight f;
  for (int i = 0; i < 40; ++i) f.tick(0.5f);
  EXPECT_TRUE(known(f.filter, f.estimate, f.now_ns));
  f.seen.clear();
  for (int i = 0; i < 10; ++i) f.tick(0.5f, false);
  EXPECT_FALSE(known(f.filter, f.estimate, f.now_ns));
}

TEST(VelocityFilter, OneJumpIsNotBelievedFiveInARowAre) {
  VelocityFilterState s;
  const VelocityFilterParams p;
  correct(p, {0.5f, 0}, 1, kDt_ns, s);
  for (int i = 2; i <= 5; ++i) {
    predict(p, {}, 0, i * kDt_ns, s);
    correct(p, {4.f, 0}, i * kDt_ns, i * kDt_ns, s);
    EXPECT_LT(s.velocity_mps.forward, 1.f) << i;
  }
  correct(p, {4.f, 0}, 6 * kDt_ns, 6 * kDt_ns, s);
  EXPECT_EQ(s.velocity_mps.forward, 4.f);
}

TEST(VelocityFilter, TurnsWithTheHeading) {
  VelocityFilterState s;
  const VelocityFilterParams p;
  correct(p, {1.f, 0}, 0, 0, s);
  for (int i = 1; i <= 20; ++i) predict(p, {}, 0.5f, i * kDt_ns, s);  // half a radian to the right in one second
  EXPECT_NEAR(s.velocity_mps.forward, std::cos(0.5f), 1e-4f);
  EXPECT_NEAR(s.velocity_mps.right, -std::sin(0.5f), 1e-4f);  // still the old way: now to the left
}

}  // namespace
}  // namespace wasp::control
