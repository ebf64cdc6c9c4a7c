// The gate before the line on virtual time: at every rate a line has, setpoints find it empty, whatever else is said.
#include "scheduling/line_gate.h"

#include <gtest/gtest.h>

#include <random>

namespace wasp::scheduling {
namespace {

constexpr DurationNs kPeriod = 50 * kMillisecond;
constexpr std::size_t kSetpoint = 51, kHeartbeat = 21;

struct Outcome {
  DurationNs worst_wait_ns = 0;  ///< of a setpoint behind what was before it
  std::uint64_t setpoints = 0, others = 0, other_bytes = 0;
};

/// A line of so many baud: control writes every 50 ms, the link thread wakes at random moments and has `sizes` to say,
/// all the time.
Outcome run(unsigned baud, const std::vector<std::size_t>& sizes, double budget_share, std::uint32_t seed) {
  const double rate = baud / 10.0;
  LineGate gate({rate, rate * budget_share});
  std::mt19937 random(seed);
  Outcome out;
  TimeNs wire_free_ns = 0, due_ns = kSecond;
  std::uint64_t total = 0;
  const auto put = [&](std::size_t bytes, TimeNs at_ns) {
    wire_free_ns = std::max(wire_free_ns, at_ns) + static_cast<DurationNs>(static_cast<double>(bytes) / rate * 1e9);
    total += bytes;
  };
  for (TimeNs now_ns = kSecond; now_ns < 61 * kSecond; now_ns += 100 * kMicrosecond * (1 + random() % 60)) {
    while (due_ns <= now_ns) {  // control woke up in between, a little late
      const TimeNs at_ns = due_ns + static_cast<DurationNs>(random() % 500) * kMicrosecond;
      out.worst_wait_ns = std::max(out.worst_wait_ns, wire_free_ns - at_ns);
      put(kSetpoint + (out.setpoints % 20 == 0 ? kHeartbeat : 0), at_ns);
      ++out.setpoints;
      due_ns += kPeriod;
    }
    gate.look(total, now_ns);
    gate.next_setpoint(due_ns);
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t bytes = sizes[random() % sizes.size()];
      if (!gate.affords(bytes, now_ns)) continue;
      put(bytes, now_ns);
      gate.spend(bytes);
      gate.look(total, now_ns);
      ++out.others;
      out.other_bytes += bytes;
    }
  }
  return out;
}

TEST(LineGate, NoSetpointWaitsOnAnyLine) {
  for (const unsigned baud : {19200u, 38400u, 57600u, 115200u, 921600u}) {
    const Outcome o = run(baud, {179, 56, 30, 25, 265, 66, 14}, 10, baud);
    std::printf("%6u baud: %llu setpoints, worst wait %lld us, %llu other frames, %.0f %% of the line\n", baud,
                static_cast<unsigned long long>(o.setpoints), static_cast<long long>(o.worst_wait_ns / kMicrosecond),
                static_cast<unsigned long long>(o.others),
                static_cast<double>(o.other_bytes) / 60 / (baud / 10.0) * 100);
    EXPECT_EQ(o.setpoints, 1199u + 1u) << baud;
    EXPECT_LE(o.worst_wait_ns, 0) << baud;
    EXPECT_GT(o.others, 1000u) << baud;
  }
}

TEST(LineGate, TheBudgetIsKept) {
  const Outcome o = run(57600, {179, 56}, 0.25, 3);
  EXPECT_LE(static_cast<double>(o.other_bytes), 0.25 * 5760 * 60 + 600);
  EXPECT_GT(static_cast<double>(o.other_bytes), 0.2 * 5760 * 60);
}

TEST(LineGate, WhatIsTooLongForTheSlowestLinesIsNeverSentRatherThanLate) {
  const Outcome o = run(9600, {265}, 10, 5);
  EXPECT_EQ(o.others, 0u);
  LineGate gate({960, 960});
  EXPECT_FALSE(gate.ever_fits(265, kSetpoint, 50 * kMillisecond));
  EXPECT_TRUE(LineGate({5760, 5760}).ever_fits(192, kSetpoint, 50 * kMillisecond));
}

TEST(LineGate, WithoutSetpointsOnlyTheBudgetCounts) {
  LineGate gate({5760, 1000});
  gate.look(0, 0);
  EXPECT_TRUE(gate.fits(100'000, 0));
  EXPECT_TRUE(gate.affords(265, 0));
  EXPECT_FALSE(gate.affords(10'000, 0));
  gate.next_setpoint(kMillisecond / 2);
  EXPECT_FALSE(gate.fits(1, 0)) << "its writer is about to wake up";
}

TEST(LineGate, ASocketCarriesWhateverComes) {
  LineGate gate({0, 20'000});
  gate.look(1'000'000, 0);
  gate.next_setpoint(10 * kMillisecond);
  EXPECT_TRUE(gate.affords(265, 0));
}

}  // namespace
}  // namespace wasp::scheduling
