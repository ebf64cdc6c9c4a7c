// How an answer is measured, on streams whose times are known.
#include "faults/reaction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/faults/wire_bench.h"

namespace wasp::faults::test {
namespace {

constexpr TimeNs kBegan = 50 * kSecond;
constexpr TimeNs ms(double after) { return kBegan + from_seconds(after * 1e-3); }

const Trial kTrial{kBegan, ms(1000), ms(2500)};
const Fault kNeutral{
    .id = "test", .promise = Promise::kNeutral, .detected_ms = 150, .response_ms = 150, .recovered_ms = 1000};

/// Steers from two seconds before the fault until `steers_until_ms`, level until `level_until_ms`, steers again.
WireBench stream(double steers_until_ms, double level_until_ms, double alarm_ms, double active_ms) {
  WireBench wire;
  wire.beat(ms(-1000), {FlightMode::kBehaviour, ModeReason::kMissionStep});
  bool alarmed = false, active = false;
  for (double t = -2000; t < 2500; t += 50) {
    const bool steers = t <= steers_until_ms || t >= level_until_ms;
    wire.setpoint(ms(t), steers ? pitched(0.05f) : level());
    if (t >= alarm_ms && !alarmed) wire.beat(ms(t), {FlightMode::kHold, ModeReason::kCueLost}), alarmed = true;
    if (t >= active_ms && !active) wire.beat(ms(t), {FlightMode::kBehaviour, ModeReason::kMissionStep}), active = true;
  }
  return wire;
}

TEST(Reaction, MeasuresDetectionResponseAndRecovery) {
  const Reaction r = react(stream(100, 1200, 150, 1200).reader, kTrial);
  EXPECT_NEAR(*r.detected_ms, 150, 1e-6);
  EXPECT_NEAR(*r.response_ms, 150, 1e-6) << "the first after the last that steers";
  EXPECT_NEAR(*r.recovered_ms, 200, 1e-6);
  EXPECT_EQ(r.reason, ModeReason::kCueLost);
  EXPECT_FALSE(r.stream_ended);
  EXPECT_FALSE(breach_of(kNeutral, kTrial, Phase::kCruise, r, true));
}

TEST(Reaction, ALateAnswerBreaksThePromiseByItsExcess) {
  const Reaction r = react(stream(300, 1200, 150, 1200).reader, kTrial);
  const auto breach = breach_of(kNeutral, kTrial, Phase::kCruise, r, true);
  ASSERT_TRUE(breach);
  EXPECT_NEAR(breach->excess_ms, 200, 1e-6);
  EXPECT_FALSE(breach_of(kNeutral, kTrial, Phase::kCruise, r, false)) << "times are not judged: it came";
}

TEST(Reaction, NoAnswerAndNoAlarmBreakItWhateverTheHostDid) {
  const Reaction silent = react(stream(9999, 0, 9999, 9999).reader, kTrial);
  EXPECT_FALSE(silent.detected_ms);
  const auto breach = breach_of(kNeutral, kTrial, Phase::kCruise, silent, false);
  ASSERT_TRUE(breach);
  EXPECT_TRUE(std::isinf(breach->excess_ms));
  EXPECT_FALSE(breach_of(kNeutral, kTrial, Phase::kIdle, silent, false)) << "on the ground no behaviour commands";
  const Reaction stuck = react(stream(100, 9999, 150, 9999).reader, kTrial);
  EXPECT_TRUE(breach_of(kNeutral, kTrial, Phase::kCruise, stuck, true)) << "never recovered";
}

TEST(Reaction, AnAlarmWithoutCauseBreaksThePromiseOfNone) {
  const Fault none{.id = "none", .promise = Promise::kUnaffected};
  EXPECT_TRUE(breach_of(none, kTrial, Phase::kHover, react(stream(100, 1200, 150, 1200).reader, kTrial), true));
  EXPECT_FALSE(breach_of(none, kTrial, Phase::kHover, react(stream(9999, 0, 9999, 9999).reader, kTrial), true));
}

TEST(Reaction, AStreamThatEndsIsAStop) {
  WireBench wire;
  wire.beat(ms(-1000), {FlightMode::kBehaviour, ModeReason::kMissionStep});
  for (double t = -2000; t <= 40; t += 50) wire.setpoint(ms(t), pitched(0.05f));
  const Reaction r = react(wire.reader, kTrial);
  EXPECT_TRUE(r.stream_ended);
  EXPECT_NEAR(*r.response_ms, 0, 1e-6);
}

TEST(Reaction, TheGuardianAndTheRestartAreSeen) {
  WireBench wire = stream(-50, 9999, 9999, 9999);
  wire.beat(ms(70), {FlightMode::kFailsafe, ModeReason::kNone, true, 0});
  Reaction r = react(wire.reader, kTrial);
  EXPECT_TRUE(r.guardian);
  std::vector<Command> commands(6);
  for (std::size_t i = 0; i < commands.size(); ++i) {
    commands[i].tick = i < 3 ? 100 + i : i - 3;
    commands[i].released_at_ns = ms(-100.0 + 100.0 * static_cast<double>(i));
  }
  read_restart(commands, kTrial, r);
  EXPECT_NEAR(*r.recovered_ms, 200, 1e-6);
}

TEST(Reaction, ALineThatWasGoneIsBackWithTheFirstSetpoint) {
  WireBench wire;
  wire.setpoint(ms(-10));
  wire.setpoint(ms(1080));
  Reaction r = react(wire.reader, kTrial);
  read_line(wire.reader, kTrial, ms(12), r);
  EXPECT_NEAR(*r.detected_ms, 12, 1e-6);
  EXPECT_NEAR(*r.recovered_ms, 80, 1e-6);
}

}  // namespace
}  // namespace wasp::faults::test
