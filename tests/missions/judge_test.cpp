#include "missions/judge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "control/mission.h"
#include "missions/measures.h"
#include "vision/heading_rate.h"

namespace wasp::missions {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Judge judge(Over over, bool at_most, double bound) { return {"x", nullptr, {{"figure", over, "m", at_most, bound}}}; }

std::vector<Measures> runs(std::vector<double> values) {
  std::vector<Measures> out;
  for (const double v : values) out.push_back({{"figure", v}});
  return out;
}

TEST(Judge, TakesTheWorstTheMeanTheMedianOrTheSum) {
  const auto of = [](Over over) { return verdict(judge(over, true, 100), runs({1, 2, 6}))[0].value; };
  EXPECT_EQ(of(Over::kWorstHigh), 6);
  EXPECT_EQ(of(Over::kWorstLow), 1);
  EXPECT_EQ(of(Over::kMean), 3);
  EXPECT_EQ(of(Over::kMedian), 2);
  EXPECT_EQ(of(Over::kSum), 9);
}

TEST(Judge, HoldsAFigureAgainstItsBarEitherWay) {
  EXPECT_TRUE(verdict(judge(Over::kWorstHigh, true, 6), runs({1, 6}))[0].ok);
  EXPECT_FALSE(verdict(judge(Over::kWorstHigh, true, 5.9), runs({1, 6}))[0].ok);
  EXPECT_TRUE(verdict(judge(Over::kWorstLow, false, 1), runs({1, 6}))[0].ok);
  EXPECT_FALSE(verdict(judge(Over::kWorstLow, false, 1.1), runs({1, 6}))[0].ok);
}

TEST(Judge, AFlightThatDoesNotTellMissesTheBar) {
  const auto result = verdict(judge(Over::kSum, true, 5), runs({0, kNan}))[0];
  EXPECT_TRUE(std::isnan(result.value));
  EXPECT_FALSE(result.ok);
  EXPECT_FALSE(verdict(judge(Over::kSum, true, 5), {Measures{}})[0].ok);
}

TEST(Judge, WithoutABarAFigureIsReportedOnly) {
  const auto result = verdict(judge(Over::kMean, true, kNan), runs({3}))[0];
  EXPECT_EQ(result.bar, "");
  EXPECT_TRUE(result.ok);
}

TEST(Judge, WhatNoFlightTellsIsLeftOutWhereThatIsAllowed) {
  Judge j = judge(Over::kWorstHigh, true, 1);
  j.bars[0].if_told = true;
  EXPECT_TRUE(verdict(j, {Measures{}}).empty());
  EXPECT_FALSE(verdict(j, runs({2})).front().ok);
}

TEST(Judge, AMissionWithoutARowMustBeFlownToItsEnd) {
  const Judge& j = judge_of("somebody's own");
  EXPECT_FALSE(verdict(j, {{{"flown to its end", 0}}})[0].ok);
  EXPECT_TRUE(verdict(j, {{{"flown to its end", 1}}})[0].ok);
}

/// A flight that came to its end, at this height.
FlightTrace at_height(float height_m) {
  FlightTrace trace;
  for (int i = 0; i < 100; ++i) {
    Truth t;
    t.exposed_at_ns = i * 50 * kMillisecond;
    t.height_m = height_m;
    t.flight_time_s = 0.05f * static_cast<float>(i);
    trace.truth.push_back(t);
    Command c;
    c.due_at_ns = t.exposed_at_ns;
    c.mission_phase = static_cast<std::uint8_t>(i < 90 ? control::MissionPhase::kLeg0 : control::MissionPhase::kDone);
    trace.commands.push_back(c);
  }
  return trace;
}

TEST(Measures, AVehicleThatStaysOnTheGroundHasNotFlown) {
  EXPECT_EQ(flown_to_its_end(at_height(1.f)), 1);
  EXPECT_EQ(flown_to_its_end(at_height(0.2f)), 0);
  EXPECT_EQ(flown_to_its_end(FlightTrace{}), 0);
}

TEST(Measures, AnAvoidBeforeTheApproachIsNoDetection) {
  const MissionSetup setup = load_mission("wall", 1);
  WorldProbe probe(setup);
  FlightTrace trace = at_height(1.2f);
  trace.lift_off_ns = 0;
  trace.commands[20].avoid = 1;  // in the hover leg
  const Measures m = measure_wall(trace, setup, probe);
  EXPECT_TRUE(std::isnan(value_of(m, "frames from avoid to impact")));
  EXPECT_EQ(value_of(m, "ticks with avoid before the approach"), 1);
}

TEST(Measures, WithoutALookThereAreNotZeroCollisions) {
  const MissionSetup setup = load_mission("wall", 1);
  WorldProbe probe(setup);
  EXPECT_TRUE(std::isnan(value_of(measure_wall(FlightTrace{}, setup, probe), "collisions")));
}

/// A flight whose camera sees a yaw rate `scale` times the gyro's.
FlightTrace yawing(double scale, double noise) {
  FlightTrace trace;
  trace.truth.resize(1);
  std::uint32_t random = 1;
  for (int i = 1; i <= 2000; ++i) {  // 200 Hz
    ImuSample s;
    s.exposed_at_ns = i * 5 * kMillisecond;
    s.gyro_body_radps[2] = static_cast<float>(0.5 * std::sin(0.01 * i));
    trace.imu.push_back(s);
    if (i % 7 != 0) continue;
    Cue c;
    c.exposed_at_ns = s.exposed_at_ns;
    c.body.validity = Validity::kValid;
    random = random * 1664525u + 1013904223u;
    const double n = noise * (static_cast<double>(random >> 8) / (1 << 23) - 1);
    c.body.detail[vision::HeadingDetail::kYawRate_radps] =
        static_cast<float>(scale * 0.5 * std::sin(0.01 * (i - 3)) + n);
    trace.cues["heading_rate"].push_back(c);
  }
  return trace;
}

TEST(YawRates, ThePairsAreOverTheSameInterval) {
  const YawRates rates = yaw_rates(yawing(1, 0), "heading_rate");
  ASSERT_GT(rates.gyro.size(), 250u);
  for (std::size_t i = 0; i < rates.gyro.size(); ++i) EXPECT_NEAR(rates.visual.y[i], rates.gyro.y[i], 2e-3) << i;
}

TEST(YawRates, NoiseShowsAndABlindFlightHasNone) {
  const YawRates clean = yaw_rates(yawing(1, 0), "heading_rate"), noisy = yaw_rates(yawing(1, 0.5), "heading_rate");
  double a = 0, b = 0;
  for (std::size_t i = 0; i < clean.gyro.size(); ++i) {
    a += std::fabs(clean.visual.y[i] - clean.gyro.y[i]);
    b += std::fabs(noisy.visual.y[i] - noisy.gyro.y[i]);
  }
  EXPECT_LT(20 * a, b);
  EXPECT_EQ(yaw_rates(yawing(1, 0), "nobody").gyro.size(), 0u);
}

}  // namespace
}  // namespace wasp::missions
