#include "sim/wind.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/vehicle.h"

namespace wasp::sim {
namespace {

TEST(Wind, ComesFromWhereItIsSaidToAndNoneIsNone) {
  Wind east({.mean_mps = 2, .from_rad = std::numbers::pi / 2}, 1);
  EXPECT_LT((east.velocity_ned_mps() - Eigen::Vector3d(0, -2, 0)).norm(), 1e-12);
  Wind calm({}, 1);
  for (int i = 0; i < 100; ++i) calm.step(1e-3);
  EXPECT_EQ(calm.velocity_ned_mps(), Eigen::Vector3d(0, 0, 0));
}

TEST(Wind, GustsHaveTheirDeviationAndCorrelationTime) {
  const WindParams params{.mean_mps = 3, .gust_mps = 1.5, .gust_time_s = 2};
  constexpr double kStep_s = 0.1;
  Wind wind(params, 7);
  double sum = 0, squares = 0, lagged = 0, vertical = 0, before = 0;
  constexpr int kSteps = 200'000;
  for (int i = 0; i < kSteps; ++i) {
    wind.step(kStep_s);
    const double gust = wind.velocity_ned_mps().x() + 3;
    sum += gust, squares += gust * gust, lagged += gust * before;
    vertical += wind.velocity_ned_mps().z() * wind.velocity_ned_mps().z();
    before = gust;
  }
  EXPECT_NEAR(sum / kSteps, 0, 0.1);
  EXPECT_NEAR(std::sqrt(squares / kSteps), 1.5, 0.06);
  EXPECT_NEAR(std::sqrt(vertical / kSteps), 0.75, 0.03);
  EXPECT_NEAR(lagged / squares, std::exp(-kStep_s / 2), 0.003);
}

TEST(Wind, TheSameSeedBlowsTheSame) {
  const WindParams params{.gust_mps = 1};
  Wind a(params, 3), b(params, 3), c(params, 4);
  for (int i = 0; i < 50; ++i) a.step(1e-3), b.step(1e-3), c.step(1e-3);
  EXPECT_EQ(a.velocity_ned_mps(), b.velocity_ned_mps());
  EXPECT_NE(a.velocity_ned_mps(), c.velocity_ned_mps());
}

TEST(Wind, CarriesAHoveringVehicleByItsDrag) {
  const VehicleParams p;
  Vehicle vehicle(p);
  VehicleState state;
  state.position_ned_m.z() = -20;
  const double hover = std::sqrt(p.mass_kg * p.gravity_mps2 / 4 / p.rotor.b());
  vehicle.reset(state, hover);
  vehicle.set_wind({0, 2, 0});
  for (int i = 0; i < 5000; ++i) vehicle.step({hover, hover, hover, hover});
  EXPECT_NEAR(vehicle.state().velocity_ned_mps.y(), 2 * (1 - std::exp(-5 * p.drag_Npmps / p.mass_kg)), 1e-3);
  EXPECT_NEAR(vehicle.state().velocity_ned_mps.x(), 0, 1e-9);
}

}  // namespace
}  // namespace wasp::sim
