#include "sim/stand.h"

#include <gtest/gtest.h>

#include <numbers>

namespace wasp::sim {
namespace {

TEST(Stand, IsStillBeforeItsStartThenSwings) {
  const StandParams p{.turntable = true, .amplitude_radps = 0.5, .period_s = 4, .start_s = 3};
  EXPECT_EQ(stand_yaw_rate_radps(p, 2.9), 0);
  EXPECT_NEAR(stand_yaw_rate_radps(p, 4), 0.5, 1e-12);
  EXPECT_NEAR(stand_yaw_rate_radps(p, 6), -0.5, 1e-12);
  EXPECT_NEAR(stand_yaw_rate_radps(p, 46), -0.5, 1e-9);
}

TEST(Stand, StepsGrowAlternateAndAreReachedWithoutAJump) {
  const StandParams p{.amplitude_radps = 0.9, .period_s = 4, .profile = StandProfile::kSteps, .start_s = 0};
  const double third = 0.3;
  int i = 0;
  for (const double level : {1., -1., 2., -2., 3., -3., 1., -1.})
    EXPECT_NEAR(stand_yaw_rate_radps(p, 2 * i++ + 1), level * third, 1e-12);
  for (double t = 0; t < 30; t += 1e-3)
    EXPECT_LT(std::abs(stand_yaw_rate_radps(p, t + 1e-3) - stand_yaw_rate_radps(p, t)), 0.01) << t;
}

TEST(Stand, CarriesTheVehicleLevelAtItsHeight) {
  const StandParams p{.turntable = true, .height_m = 1.5, .amplitude_radps = 0.5, .period_s = 4, .start_s = 0};
  VehicleState state;
  for (int i = 0; i < 2000; ++i) state = carried(p, state, i * kPhysicsStep_s, 9.81);
  EXPECT_EQ(state.position_ned_m, Eigen::Vector3d(0, 0, -1.5));
  const Eigen::Vector3d ahead = state.q_ned_body * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(ahead.y(), ahead.x()), 0.5 * 4 / std::numbers::pi, 2e-3) << "the integral of half a sine";
  EXPECT_NEAR(ahead.z(), 0, 1e-12);
  EXPECT_EQ(state.specific_force_body_mps2, Eigen::Vector3d(0, 0, -9.81));
  EXPECT_TRUE(state.on_ground);
}

}  // namespace
}  // namespace wasp::sim
