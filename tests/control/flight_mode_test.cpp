#include "control/flight_mode.h"

#include <gtest/gtest.h>

namespace wasp::control {
namespace {

constexpr Situation kGood{.autopilot_armed = true,
                          .autopilot_follows = true,
                          .link_alive = true,
                          .attitude_fresh = true,
                          .ground_seen = true,
                          .images_fresh = true};

FlightMode mode_in(Situation s) {
  ModeState state;
  flight_mode_step(s, state);
  return state.mode;
}

TEST(FlightMode, EveryLossHasItsNamedResponse) {
  EXPECT_EQ(mode_in(kGood), FlightMode::kBehaviour);
  Situation s = kGood;
  s.ground_seen = false;
  EXPECT_EQ(mode_in(s), FlightMode::kHold);
  s.ground_lost_long = true;
  EXPECT_EQ(mode_in(s), FlightMode::kFailsafe);
  s = kGood, s.images_fresh = false;  // a barometer may still know the height
  EXPECT_EQ(mode_in(s), FlightMode::kHold);
  s = kGood, s.attitude_fresh = false;
  EXPECT_EQ(mode_in(s), FlightMode::kFailsafe);
  s = kGood, s.setpoint_finite = false;
  EXPECT_EQ(mode_in(s), FlightMode::kFailsafe);
  s = kGood, s.link_alive = false;
  EXPECT_EQ(mode_in(s), FlightMode::kFailsafe);
  s = kGood, s.deadlines_missed = true;
  EXPECT_EQ(mode_in(s), FlightMode::kHold);
  s = kGood, s.autopilot_follows = false;
  EXPECT_EQ(mode_in(s), FlightMode::kManual);
  s = kGood, s.autopilot_armed = false;
  EXPECT_EQ(mode_in(s), FlightMode::kDisarmed);
}

TEST(FlightMode, DisarmedWinsOverEverythingAndManualOverVision) {
  for (unsigned bits = 0; bits < 512; ++bits) {
    const auto bit = [&](unsigned i) { return (bits >> i & 1u) != 0; };
    const Situation s{bit(0), bit(1), bit(2), bit(3), bit(4), bit(5), bit(6), bit(7), bit(8)};
    const FlightMode mode = mode_in(s);
    if (!s.autopilot_armed) {
      EXPECT_EQ(mode, FlightMode::kDisarmed);
    } else if (s.link_alive && !s.autopilot_follows) {
      EXPECT_EQ(mode, FlightMode::kManual);
    }
    if (mode == FlightMode::kBehaviour) {
      EXPECT_TRUE(s.link_alive && s.attitude_fresh && s.ground_seen && s.images_fresh && s.setpoint_finite &&
                  !s.deadlines_missed);
    }
  }
}

TEST(FlightMode, ChangeIsReportedOnceWithItsReason) {
  ModeState state;
  EXPECT_TRUE(flight_mode_step(kGood, state));
  EXPECT_FALSE(flight_mode_step(kGood, state));
  Situation s = kGood;
  s.attitude_fresh = false;
  EXPECT_TRUE(flight_mode_step(s, state));
  EXPECT_EQ(state.reason, ModeReason::kAttitudeLost);
}

}  // namespace
}  // namespace wasp::control
