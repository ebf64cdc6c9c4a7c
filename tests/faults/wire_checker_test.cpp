// Each way in which a stream can be bad is caught, and a good one passes.
#include "faults/wire_checker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/faults/wire_bench.h"

namespace wasp::faults::test {
namespace {

constexpr TimeNs kStart = 100 * kSecond;
constexpr DurationNs kPeriod = 50 * kMillisecond;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A good stream of two seconds to an armed vehicle, with the commands and exposures behind it.
struct GoodStream {
  GoodStream() {
    wire.armed(kStart - kSecond, false);
    wire.ask_to_arm(kStart - kMillisecond);
    wire.armed(kStart, true);
    for (int i = 1; i <= 40; ++i) tick(kStart + i * kPeriod);
  }
  void tick(TimeNs at_ns, DurationNs age_ns = 40 * kMillisecond) {
    Command c;
    c.exposed_at_ns = at_ns - age_ns;
    c.released_at_ns = at_ns - kMillisecond;
    c.written_at_ns = at_ns;
    c.tick = evidence.commands.size();
    c.thrust = 0.8f + 0.001f * static_cast<float>(c.tick % 7);
    c.sent = 1;
    evidence.commands.push_back(c);
    evidence.exposures.push_back(c.exposed_at_ns);
    last = wire.setpoint(at_ns, level(), 0, c.thrust);
  }
  [[nodiscard]] std::vector<Violation> check() const { return check_wire(wire.reader, WireLimits{}, evidence); }
  [[nodiscard]] TimeNs next_ns() const { return wire.reader.setpoints.back().at_ns + kPeriod; }

  WireBench wire;
  WireEvidence evidence;
  std::vector<std::uint8_t> last;
};

/// Exactly this one offence, and the time of it.
void expect_only(const std::vector<Violation>& found, Offence offence, TimeNs at_ns) {
  ASSERT_EQ(found.size(), 1u) << "expected: " << name_of(offence);
  EXPECT_EQ(name_of(found[0].offence), std::string(name_of(offence)));
  EXPECT_EQ(found[0].at_ns, at_ns);
}

TEST(WireChecker, PassesAGoodStream) { EXPECT_TRUE(GoodStream().check().empty()); }

TEST(WireChecker, CatchesNumbersThatAreNone) {
  for (int where = 0; where < 3; ++where) {
    GoodStream s;
    s.evidence.commands.clear();
    auto q = level();
    if (where == 0) q[2] = kNan;
    const TimeNs at_ns = s.next_ns();
    s.wire.setpoint(at_ns, q, where == 1 ? kNan : 0, where == 2 ? std::numeric_limits<float>::infinity() : 0.8f);
    expect_only(s.check(), Offence::kNotFinite, at_ns);
  }
}

TEST(WireChecker, CatchesWhatIsBeyondTheLimits) {
  struct Bad {
    std::array<float, 4> q;
    float yaw_rate, thrust;
    Offence offence;
  };
  for (const Bad& bad :
       {Bad{{2, 0, 0, 0}, 0, 0.8f, Offence::kNoRotation}, Bad{{0, 0, 0, 0}, 0, 0.8f, Offence::kNoRotation},
        Bad{pitched(0.3f), 0, 0.8f, Offence::kTilt}, Bad{pitched(-0.3f), 0, 0.8f, Offence::kTilt},
        Bad{level(), 0.9f, 0.8f, Offence::kYawRate}, Bad{level(), -0.9f, 0.8f, Offence::kYawRate},
        Bad{level(), 0, 1.1f, Offence::kThrust}, Bad{level(), 0, -0.1f, Offence::kThrust}}) {
    GoodStream s;
    s.evidence.commands.clear();
    const TimeNs at_ns = s.next_ns();
    s.wire.setpoint(at_ns, bad.q, bad.yaw_rate, bad.thrust);
    expect_only(s.check(), bad.offence, at_ns);
  }
  GoodStream at_the_limits;
  at_the_limits.evidence.commands.clear();
  at_the_limits.wire.setpoint(at_the_limits.next_ns(), pitched(0.2617f), 0.8f, 1.f);
  EXPECT_TRUE(at_the_limits.check().empty());
}

TEST(WireChecker, CatchesAnOldSetpointSentOnceMore) {
  GoodStream s;
  s.evidence.commands.clear();
  const TimeNs at_ns = s.next_ns();
  s.wire.bytes(at_ns, Direction::kToAutopilot, s.last);
  const auto found = s.check();
  expect_only(found, Offence::kResent, at_ns);
  EXPECT_FALSE(found[0].bytes.empty());
}

TEST(WireChecker, CatchesSilenceTowardsAnArmedVehicleUnlessItIsExcused) {
  GoodStream s;
  const TimeNs from_ns = s.next_ns(), at_ns = from_ns + 300 * kMillisecond;
  s.tick(at_ns);
  expect_only(s.check(), Offence::kGap, at_ns);
  EXPECT_NEAR(s.check()[0].value, 350, 1e-6);
  s.evidence.gaps_excused = {{from_ns, from_ns + kMillisecond}};
  EXPECT_TRUE(s.check().empty());
  GoodStream disarmed;
  disarmed.wire.armed(disarmed.next_ns(), false);
  disarmed.tick(disarmed.next_ns() + 300 * kMillisecond);
  EXPECT_TRUE(disarmed.check().empty()) << "nobody depends on it";
}

TEST(WireChecker, CatchesARequestToArmOnceTheVehicleWasArmed) {
  GoodStream s;
  s.wire.ask_to_arm(kStart + 100 * kMillisecond);  // a repetition that was under way
  EXPECT_TRUE(s.check().empty());
  s.wire.ask_to_arm(kStart + kSecond);
  expect_only(s.check(), Offence::kRearmed, kStart + kSecond);
  GoodStream after;
  after.wire.armed(after.next_ns(), false);
  const TimeNs at_ns = after.next_ns() + kSecond;
  after.wire.ask_to_arm(at_ns);
  expect_only(after.check(), Offence::kRearmed, at_ns);
}

TEST(WireChecker, CatchesASetpointThatNoControlTickMade) {
  GoodStream s;
  const TimeNs at_ns = s.next_ns();
  s.wire.setpoint(at_ns, level(), 0, 0.123f);
  s.tick(at_ns + kPeriod);
  expect_only(s.check(), Offence::kNotOurs, at_ns);
  s.evidence.not_joined = {{at_ns - kMillisecond, at_ns + kMillisecond}};
  EXPECT_TRUE(s.check().empty()) << "the guardian's";
}

TEST(WireChecker, CatchesEvidenceThatIsTooOldOnTheWireWithHowLongTheLineHeldIt) {
  GoodStream s;
  const TimeNs at_ns = s.next_ns();
  s.tick(at_ns, 260 * kMillisecond);
  s.evidence.commands.back().written_at_ns = at_ns - 5 * kMillisecond;
  s.evidence.exposures.clear();
  const auto found = s.check();
  expect_only(found, Offence::kOldEvidence, at_ns);
  EXPECT_NEAR(found[0].value, 260, 1e-6);
  EXPECT_NEAR(found[0].held_ms, 5, 1e-6);
}

TEST(WireChecker, CatchesAFrameThatTheCameraNeverShowed) {
  GoodStream s;
  const TimeNs at_ns = s.next_ns();
  s.tick(at_ns);
  s.evidence.exposures.back() += 1;
  expect_only(s.check(), Offence::kNoSuchFrame, at_ns);
  s.evidence.unseen = {{at_ns - kSecond, at_ns}};
  EXPECT_TRUE(s.check().empty()) << "we may have missed it ourselves";
}

TEST(WireChecker, CatchesAFrameThatHadToBeKnownBad) {
  GoodStream s;
  const TimeNs at_ns = s.next_ns();
  s.evidence.tainted = {{at_ns - 45 * kMillisecond, at_ns + kSecond}};
  s.tick(at_ns);
  expect_only(s.check(), Offence::kTaintedFrame, at_ns);
}

TEST(WireChecker, DamagedFramesAreNoSetpoints) {
  GoodStream s;
  auto damaged = s.last;
  damaged[20] ^= 1;
  s.wire.bytes(s.next_ns(), Direction::kToAutopilot, damaged);
  EXPECT_TRUE(s.check().empty());
  EXPECT_EQ(s.wire.reader.companion_counts().bad_crc, 1u);
}

}  // namespace
}  // namespace wasp::faults::test
