// The hover bar on virtual time, where no host can disturb it: the same step functions, the same bytes, other seeds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "sim/lockstep.h"
#include "vision/edge_altitude.h"
#include "vision/ground_altitude.h"

namespace wasp::sim {
namespace {

control::ControlParams hover(float seconds) {
  control::ControlParams p;
  p.arbiter.behaviour_count = 2;
  p.arbiter.rows[0].height_rank = 0;
  p.mission.leg_count = 2;
  p.mission.legs = {control::HoverLeg{0.5f, seconds}, control::HoverLeg{1.0f, seconds}};
  return p;
}

LockstepOptions options(std::uint32_t seed, float seconds) {
  LockstepOptions o;
  o.sim.seed = seed;
  o.control = hover(seconds);
  vision::GroundAltitude::Params ground;
  vision::EdgeAltitude::Params edge;
  ground.camera = edge.camera = o.sim.camera;
  o.behaviours = {lockstep_behaviour<vision::GroundAltitude>(0, ground),
                  lockstep_behaviour<vision::EdgeAltitude>(1, edge)};
  return o;
}

struct Errors {
  double rms_m = 0, worst_m = 0;
  int n = 0;
};

/// Height errors against truth from a while after the start of a leg.
Errors errors_of(const std::vector<LockstepSample>& samples, int leg, double setpoint_m,
                 DurationNs settle_ns = 5 * kSecond) {
  Errors e;
  TimeNs start_ns = kNever;
  for (const auto& s : samples) {
    if (control::leg_of(static_cast<control::MissionPhase>(s.command.mission_phase)) != leg) continue;
    if (start_ns == kNever) start_ns = s.at_ns;
    if (s.at_ns - start_ns < settle_ns) continue;
    const double error_m = static_cast<double>(s.truth.height_m) - setpoint_m;
    e.rms_m += error_m * error_m;
    e.worst_m = std::max(e.worst_m, std::fabs(error_m));
    ++e.n;
  }
  e.rms_m = std::sqrt(e.rms_m / std::max(1, e.n));
  return e;
}

class LockstepHover : public ::testing::TestWithParam<std::uint32_t> {};

TEST_P(LockstepHover, HoldsBothHeightsWithinTheBar) {
  const auto samples = Lockstep(options(GetParam(), 12.f)).fly(60).samples;
  ASSERT_FALSE(samples.empty());
  EXPECT_EQ(static_cast<control::MissionPhase>(samples.back().command.mission_phase), control::MissionPhase::kDone);
  for (const auto& [leg, setpoint_m] : {std::pair{0, 0.5}, std::pair{1, 1.0}}) {
    const Errors e = errors_of(samples, leg, setpoint_m);
    ASSERT_GT(e.n, 100);
    RecordProperty("rms_mm_" + std::to_string(leg), static_cast<int>(e.rms_m * 1000));
    EXPECT_LE(e.rms_m, 0.05) << "leg " << leg;
    EXPECT_LE(e.worst_m, 0.15) << "leg " << leg;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, LockstepHover, ::testing::Values(1u, 77u, 2026u));

struct OtherAutopilot {
  Flavour flavour;
  std::uint32_t seed;
};
class LockstepAs : public ::testing::TestWithParam<OtherAutopilot> {};

/// The same control and the same questions before arming as in the flight process; PX4 with the hover thrust from the
/// factory, 0.5, for a vehicle that needs 0.84; ArduCopter by climb rates.
TEST_P(LockstepAs, HoldsBothHeightsAndLands) {
  LockstepOptions o = options(GetParam().seed, 25.f);
  o.sim.flavour = GetParam().flavour;
  const auto samples = Lockstep(o).fly(120).samples;
  ASSERT_FALSE(samples.empty());
  EXPECT_EQ(static_cast<control::MissionPhase>(samples.back().command.mission_phase), control::MissionPhase::kDone);
  float highest_m = 0;
  for (const auto& s : samples) highest_m = std::max(highest_m, s.truth.height_m);
  EXPECT_LT(highest_m, 1.4f) << "no leap at take-off";
  for (const auto& [leg, setpoint_m] : {std::pair{0, 0.5}, std::pair{1, 1.0}}) {
    const Errors e = errors_of(samples, leg, setpoint_m, (leg == 0 ? 12 : 5) * kSecond);
    ASSERT_GT(e.n, 100);
    std::printf("[ figures  ] leg %d: RMS %.1f mm, worst %.1f mm\n", leg, e.rms_m * 1000, e.worst_m * 1000);
    EXPECT_LE(e.rms_m, 0.05) << "leg " << leg;
    EXPECT_LE(e.worst_m, 0.15) << "leg " << leg;
  }
}

INSTANTIATE_TEST_SUITE_P(Autopilots, LockstepAs,
                         ::testing::Values(OtherAutopilot{Flavour::kPx4, 1}, OtherAutopilot{Flavour::kPx4, 77},
                                           OtherAutopilot{Flavour::kArduPilot, 1},
                                           OtherAutopilot{Flavour::kArduPilot, 77}),
                         [](const auto& of) {
                           return std::string(drivers::facts_of(of.param.flavour).name) + "_" +
                                  std::to_string(of.param.seed);
                         });

TEST(Lockstep, SameSeedSameFlightToTheBit) {
  const auto a = Lockstep(options(5, 2.f)).fly(10), b = Lockstep(options(5, 2.f)).fly(10);
  ASSERT_EQ(a.samples.size(), b.samples.size());
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    ASSERT_EQ(a.samples[i].truth.position_ned_m, b.samples[i].truth.position_ned_m) << i;
    ASSERT_EQ(a.samples[i].command.thrust, b.samples[i].command.thrust) << i;
  }
  ASSERT_EQ(a.cues.size(), b.cues.size());
  for (std::size_t i = 0; i < a.cues.size(); ++i) {
    ASSERT_EQ(a.cues[i].body.height_m, b.cues[i].body.height_m) << i;
  }
}

TEST(Lockstep, BlindItHoldsThenDescends) {
  LockstepOptions o = options(3, 5.f);
  o.sim.sensor.max_range_m = 0.41f;  // the sensor sees nothing from the air
  o.control.mission.patience_s = 5;
  const auto samples = Lockstep(o).fly(10).samples;
  ASSERT_FALSE(samples.empty());
  EXPECT_EQ(static_cast<control::MissionPhase>(samples.back().command.mission_phase), control::MissionPhase::kBroken);
  for (const auto& s : samples) EXPECT_EQ(s.command.thrust, 0.f);  // it never left the ground
}

}  // namespace
}  // namespace wasp::sim
