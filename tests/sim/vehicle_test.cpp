#include "sim/vehicle.h"

#include <gtest/gtest.h>

namespace wasp::sim {
namespace {

constexpr std::array<double, 4> kOff{};

double hover_speed(const VehicleParams& p) { return std::sqrt(p.mass_kg * p.gravity_mps2 / 4 / p.rotor.b()); }

Vehicle flying(const VehicleParams& params) {
  Vehicle vehicle(params);
  VehicleState state;
  state.position_ned_m.z() = -2;
  vehicle.reset(state, hover_speed(params));
  return vehicle;
}

void run(Vehicle& vehicle, const std::array<double, 4>& wanted, int milliseconds) {
  for (int i = 0; i < milliseconds; ++i) vehicle.step(wanted);
}

/// Hover speeds with some of the thrust moved between rotors: share of thrust added to each.
std::array<double, 4> around_hover(const VehicleParams& p, const std::array<double, 4>& share) {
  std::array<double, 4> wanted{};
  for (std::size_t i = 0; i < 4; ++i) wanted[i] = hover_speed(p) * std::sqrt(1 + share[i]);
  return wanted;
}

TEST(VehicleParams, InertiaIsTheSumOfTheRowsAndRotorsMatchTheThesis) {
  const VehicleParams p;
  double xx = kKinectRow.xx;
  for (const auto& row : kKontronRows) xx += row.xx;
  EXPECT_DOUBLE_EQ(p.inertia_kgm2.xx, xx);
  const double w = p.rotor.max_speed_radps();
  EXPECT_NEAR(p.rotor.b() * w * w, 5.6, 1e-9);
  EXPECT_NEAR(p.hover_thrust(), 1.925 * 9.81 / 22.4, 1e-9);
}

TEST(VehicleParams, PresetsAreTheColumnsOfTableA4WithTheRowsOfTableB2) {
  EXPECT_EQ(kVehiclePresets[0].params().mass_kg, VehicleParams{}.mass_kg);
  EXPECT_EQ(kVehiclePresets[0].params().inertia_kgm2.yy, VehicleParams{}.inertia_kgm2.yy);
  const VehicleParams kontron = kVehiclePresets[1].params(), gumstix = kVehiclePresets[2].params();
  EXPECT_DOUBLE_EQ(kontron.mass_kg, 1.230);
  EXPECT_NEAR(kontron.inertia_kgm2.xx + kKinectRow.xx, VehicleParams{}.inertia_kgm2.xx, 1e-12);
  EXPECT_DOUBLE_EQ(gumstix.mass_kg, 0.700);
  EXPECT_NEAR(kontron.inertia_kgm2.xx - gumstix.inertia_kgm2.xx, 4.36e-3 - 1.01e-3, 1e-12);
  EXPECT_NEAR(kontron.inertia_kgm2.yy - gumstix.inertia_kgm2.yy, 4.36e-3 - 1.05e-3, 1e-12);
  EXPECT_NEAR(kontron.inertia_kgm2.zz, gumstix.inertia_kgm2.zz, 1e-12);
}

TEST(Rotor, ReachesFullSpeedOnTheSupplyAndRespondsInTheRegulatorsTime) {
  const RotorParams params;
  Rotor rotor(params);
  const double hover = 575;
  rotor.set_speed(hover);
  for (int i = 0; i < 50; ++i) rotor.step(hover + 10, 1e-3);
  EXPECT_NEAR(rotor.speed_radps(), hover + 10 * (1 - std::exp(-1.0)), 0.7);
  for (int i = 0; i < 3000; ++i) rotor.step(1e9, 1e-3);
  EXPECT_NEAR(rotor.speed_radps(), params.max_speed_radps(), 0.01);
}

TEST(Vehicle, StandsStillOnItsLegs) {
  Vehicle vehicle{VehicleParams{}};
  run(vehicle, kOff, 3000);
  EXPECT_NEAR(vehicle.state().position_ned_m.z(), -0.20, 1e-6);
  EXPECT_NEAR(vehicle.state().velocity_ned_mps.norm(), 0, 1e-9);
  EXPECT_NEAR(vehicle.state().specific_force_body_mps2.z(), -9.81, 1e-6);
  EXPECT_TRUE(vehicle.state().on_ground);
}

TEST(Vehicle, HoversAtHoverThrust) {
  const VehicleParams p;
  Vehicle vehicle = flying(p);
  run(vehicle, around_hover(p, {}), 10'000);
  EXPECT_NEAR(vehicle.state().position_ned_m.z(), -2, 1e-3);
  EXPECT_NEAR(vehicle.state().rate_body_radps.norm(), 0, 1e-9);
}

TEST(Vehicle, FallsFreelyWithoutRotorsAndDrag) {
  VehicleParams p;
  p.drag_Npmps = 0;
  Vehicle vehicle(p);
  VehicleState state;
  state.position_ned_m.z() = -10;
  vehicle.reset(state);
  run(vehicle, kOff, 1000);
  EXPECT_NEAR(vehicle.state().velocity_ned_mps.z(), 9.81, 1e-6);
  EXPECT_NEAR(vehicle.state().position_ned_m.z(), -10 + 4.905, 0.006);  // semi-implicit: half a step of speed
  EXPECT_NEAR(vehicle.state().specific_force_body_mps2.norm(), 0, 1e-9);
}

TEST(Vehicle, LandsWithoutBouncing) {
  Vehicle vehicle{VehicleParams{}};
  VehicleState state;
  state.position_ned_m.z() = -0.5;
  state.velocity_ned_mps.x() = 0.5;
  vehicle.reset(state);
  bool touched = false;
  double highest_m = 0;
  for (int i = 0; i < 3000; ++i) {
    vehicle.step(kOff);
    touched = touched || vehicle.state().on_ground;
    if (touched) highest_m = std::max(highest_m, -vehicle.state().position_ned_m.z());
  }
  EXPECT_LT(highest_m, 0.205) << "after the first touch";
  EXPECT_NEAR(vehicle.state().position_ned_m.z(), -0.20, 1e-4);
  EXPECT_LT(vehicle.state().velocity_ned_mps.norm(), 1e-3) << "friction stops the slide";
}

TEST(Vehicle, LeftThrustRollsRightFrontThrustPitchesUp) {
  const VehicleParams p;
  Vehicle roll = flying(p), pitch = flying(p);
  run(roll, around_hover(p, {0, -0.05, 0, 0.05}), 200);
  EXPECT_GT(roll.state().rate_body_radps.x(), 0.05);
  EXPECT_GT((roll.state().q_ned_body * Eigen::Vector3d::UnitY()).z(), 0) << "right side down";
  run(pitch, around_hover(p, {0.05, 0, -0.05, 0}), 200);
  EXPECT_GT(pitch.state().rate_body_radps.y(), 0.05);
  EXPECT_LT((pitch.state().q_ned_body * Eigen::Vector3d::UnitX()).z(), 0) << "nose up";
}

TEST(Vehicle, CounterClockwiseRotorsYawClockwise) {
  const VehicleParams p;
  Vehicle vehicle = flying(p);
  run(vehicle, around_hover(p, {-0.05, 0.05, -0.05, 0.05}), 500);
  EXPECT_GT(vehicle.state().rate_body_radps.z(), 0.02);
  EXPECT_NEAR(vehicle.state().rate_body_radps.x(), 0, 1e-6);
}

TEST(Vehicle, DragBringsSidewaysSpeedDown) {
  const VehicleParams p;
  Vehicle vehicle = flying(p);
  VehicleState state = vehicle.state();
  state.velocity_ned_mps.y() = 1;
  vehicle.reset(state, hover_speed(p));
  run(vehicle, around_hover(p, {}), 1000);
  EXPECT_NEAR(vehicle.state().velocity_ned_mps.y(), std::exp(-p.drag_Npmps / p.mass_kg), 1e-3);
}

}  // namespace
}  // namespace wasp::sim
