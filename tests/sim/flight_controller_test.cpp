#include "sim/flight_controller.h"

#include <gtest/gtest.h>

#include <numbers>

#include "sim/imu_model.h"
#include "sim/vehicle.h"

namespace wasp::sim {
namespace {

constexpr float kDegree = std::numbers::pi_v<float> / 180;

/// Vehicle, sensors and controller without a serial line.
class Flight {
 public:
  explicit Flight(std::uint32_t seed = 1) : imu_({}, seed), controller(params) {}

  /// One 5 ms tick; the setpoint is renewed unless silent.
  void tick() {
    if (!silent) controller.set_setpoint(setpoint, now);
    const auto wanted = controller.step(imu_.sample(vehicle.state(), 0.005, now), vehicle.state().on_ground, now);
    for (int i = 0; i < 5; ++i) vehicle.step(wanted);
    now += 5 * kMillisecond;
  }
  void run(double seconds) {
    for (int i = 0; i < static_cast<int>(seconds * 200); ++i) tick();
  }
  /// Arms after a settling time and climbs to about two metres with a crude hand on the thrust.
  void take_off() {
    run(3);
    EXPECT_EQ(controller.set_mode(ControllerMode::kOffboard), CommandResult::kAccepted);
    EXPECT_EQ(controller.arm(true, false), CommandResult::kAccepted);
    for (int i = 0; i < 200 * 8; ++i) hold_height(2), tick();
  }
  void hold_height(double height_m) {
    const double h = -vehicle.state().position_ned_m.z(), climb = -vehicle.state().velocity_ned_mps.z();
    setpoint.thrust = static_cast<float>(params.hover_thrust() + 0.1 * (height_m - h) - 0.12 * climb);
  }
  void run_at(double height_m, double seconds) {
    for (int i = 0; i < static_cast<int>(seconds * 200); ++i) hold_height(height_m), tick();
  }
  [[nodiscard]] Euler truth() const { return euler_from_quat(vehicle.state().q_ned_body.cast<float>()); }

  VehicleParams params;
  Vehicle vehicle{params};
  ImuModel imu_;
  FlightController controller;
  AttitudeSetpoint setpoint;
  TimeNs now = 10 * kSecond;
  bool silent = false;
};

TEST(FlightController, ReachesCommandedPitchAndRoll) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    Flight flight(seed);
    flight.take_off();
    flight.setpoint.euler.pitch_rad = -8 * kDegree;
    flight.run_at(2, 2);
    EXPECT_NEAR(flight.truth().pitch_rad / kDegree, -8, 0.5) << "seed " << seed;
    flight.setpoint.euler = {6 * kDegree, 0, 0};
    flight.run_at(2, 2);
    EXPECT_NEAR(flight.truth().roll_rad / kDegree, 6, 0.5) << "seed " << seed;
    EXPECT_NEAR(flight.truth().pitch_rad / kDegree, 0, 0.5) << "seed " << seed;
  }
}

TEST(FlightController, SettlesWithoutMuchOvershoot) {
  Flight flight;
  flight.take_off();
  flight.setpoint.euler.roll_rad = 6 * kDegree;
  float most = 0;
  for (int i = 0; i < 300; ++i) {
    flight.run_at(2, 0.005);
    most = std::max(most, flight.truth().roll_rad);
  }
  EXPECT_LT(most / kDegree, 7.0f);
}

TEST(FlightController, FollowsAYawRateAndAHeading) {
  Flight flight;
  flight.take_off();
  flight.setpoint.yaw_by_rate = true;
  flight.setpoint.yaw_rate_radps = 0.5f;
  flight.run_at(2, 3);
  EXPECT_NEAR(flight.vehicle.state().rate_body_radps.z(), 0.5, 0.05);
  flight.setpoint.yaw_by_rate = false;
  flight.setpoint.euler.yaw_rad = -0.5f;
  flight.run_at(2, 15);
  EXPECT_NEAR(flight.truth().yaw_rad, -0.5f, 0.05f);
}

TEST(FlightController, SilenceLevelsDescendsLandsAndDisarms) {
  Flight flight;
  flight.take_off();
  flight.setpoint.euler.pitch_rad = -8 * kDegree;
  flight.run_at(2, 0.5);
  while (!flight.controller.take_event().empty()) {
  }
  flight.silent = true;
  flight.run(0.45);
  EXPECT_FALSE(flight.controller.descending());
  flight.run(0.1);
  EXPECT_TRUE(flight.controller.descending());
  EXPECT_NE(flight.controller.take_event().find("no setpoint"), std::string_view::npos);
  flight.run(1);
  EXPECT_NEAR(flight.truth().pitch_rad / kDegree, 0, 1);
  double fastest = 0;
  for (int i = 0; i < 200 * 20 && flight.controller.armed(); ++i) {
    flight.tick();
    fastest = std::max(fastest, flight.vehicle.state().velocity_ned_mps.z());
  }
  EXPECT_LT(fastest, 0.7) << "gently";
  EXPECT_FALSE(flight.controller.armed());
  flight.run(1);
  EXPECT_NEAR(flight.vehicle.state().position_ned_m.z(), -0.2, 0.01);
}

TEST(FlightController, ANewSetpointEndsTheDescent) {
  Flight flight;
  flight.take_off();
  flight.silent = true;
  flight.run(0.7);
  ASSERT_TRUE(flight.controller.descending());
  flight.silent = false;
  flight.run_at(2, 0.1);
  EXPECT_FALSE(flight.controller.descending());
}

TEST(FlightController, RefusesWhatIsUnsafe) {
  Flight flight;
  EXPECT_EQ(flight.controller.arm(true, false), CommandResult::kTemporarilyRejected) << "estimate not settled";
  flight.take_off();
  EXPECT_EQ(flight.controller.arm(false, false), CommandResult::kDenied) << "in flight";
  EXPECT_EQ(flight.controller.arm(false, true), CommandResult::kAccepted) << "forced";
  EXPECT_FALSE(flight.controller.armed());
}

TEST(FlightController, AttitudeHoldsAtFullCollective) {
  Flight flight;
  flight.take_off();
  flight.setpoint.thrust = 1;
  flight.setpoint.euler.roll_rad = 5 * kDegree;
  flight.run(1.5);
  EXPECT_NEAR(flight.truth().roll_rad / kDegree, 5, 0.7);
}

}  // namespace
}  // namespace wasp::sim
