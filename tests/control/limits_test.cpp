#include "control/limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace wasp::control {
namespace {

TEST(Limits, WhateverIsWantedWhatIsSentStaysInsideRangeAndRate) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> wild(-100.f, 100.f);
  LimitParams p;
  Setpoint s;
  for (int i = 0; i < 20'000; ++i) {
    const Setpoint before = s;
    ASSERT_TRUE(limit(p, {wild(random), wild(random), wild(random), wild(random)}, 0.05f, s));
    EXPECT_LE(std::fabs(s.roll_rad), p.max_tilt_rad);
    EXPECT_LE(std::fabs(s.pitch_rad), p.max_tilt_rad);
    EXPECT_LE(std::fabs(s.yaw_rate_radps), p.max_yaw_rate_radps);
    EXPECT_GE(s.thrust, p.thrust_min);
    EXPECT_LE(s.thrust, p.thrust_max);
    EXPECT_LE(std::fabs(s.roll_rad - before.roll_rad), p.max_tilt_rate_radps * 0.05f + 1e-6f);
    EXPECT_LE(std::fabs(s.thrust - before.thrust), p.max_thrust_rate_1ps * 0.05f + 1e-6f);
  }
}

TEST(Limits, LevelIsOneStepAndLeavesTheThrustAlone) {
  Setpoint s{0.26f, -0.26f, 0.8f, 0.7f};
  level(s);
  EXPECT_EQ(s.roll_rad, 0.f);
  EXPECT_EQ(s.pitch_rad, 0.f);
  EXPECT_EQ(s.yaw_rate_radps, 0.f);
  EXPECT_EQ(s.thrust, 0.7f);
}

TEST(Limits, NonFiniteIsRefusedAndChangesNothing) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  const Setpoint before{0.1f, -0.1f, 0.2f, 0.5f};
  for (const float bad : {kNan, kInf, -kInf})
    for (int field = 0; field < 4; ++field) {
      Setpoint wanted, s = before;
      (field == 0   ? wanted.roll_rad
       : field == 1 ? wanted.pitch_rad
       : field == 2 ? wanted.yaw_rate_radps
                    : wanted.thrust) = bad;
      EXPECT_FALSE(limit(LimitParams{}, wanted, 0.05f, s));
      EXPECT_EQ(s.thrust, before.thrust);
      EXPECT_EQ(s.roll_rad, before.roll_rad);
    }
}

}  // namespace
}  // namespace wasp::control
