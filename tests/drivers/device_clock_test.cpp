#include "drivers/device_clock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace wasp::drivers {
namespace {

constexpr double kTicks_per_s = 60e6;
constexpr TimeNs kBegin = 5'000 * kSecond;

/// A 60 MHz counter that starts shortly before its wrap and runs fast, heard through a late and ragged bus.
struct Bus {
  double drift = 80e-6;
  std::uint64_t first_tick = (1ull << 32) - 120'000'000;  ///< wraps after 2 s, and every 71.6 s
  DurationNs least_ns = 2 * kMillisecond;
  std::mt19937 random{1};

  [[nodiscard]] std::uint32_t ticks_at(double t_s) const {
    return static_cast<std::uint32_t>(first_tick + static_cast<std::uint64_t>(t_s * kTicks_per_s * (1 + drift)));
  }
  /// What a right map says of a stamp taken at t_s.
  [[nodiscard]] TimeNs right(double t_s) const { return kBegin + from_seconds(t_s) + least_ns; }
  TimeNs arrival(double t_s) {
    std::exponential_distribution<double> jitter_s(1 / 0.002);
    const double spike_s = random() % 20 == 0 ? 0.05 : 0;
    return right(t_s) + from_seconds(jitter_s(random) + spike_s);
  }
};

TEST(DeviceClock, FollowsADriftingCounterOverItsWraps) {
  Bus bus;
  DeviceClock clock(kTicks_per_s);
  DurationNs worst_settled = 0, worst = 0;
  for (int frame = 0; frame < 30 * 300; ++frame) {
    const double t_s = frame / 30.0;
    ASSERT_TRUE(clock.add(bus.ticks_at(t_s), bus.arrival(t_s)));
    const DurationNs error = clock.to_local(bus.ticks_at(t_s)) - bus.right(t_s);
    if (t_s > 1) worst = std::max(worst, std::abs(error));
    if (t_s > 30) worst_settled = std::max(worst_settled, std::abs(error));
  }
  EXPECT_LT(worst, 3 * kMillisecond);
  EXPECT_LT(worst_settled, kMillisecond / 2);
  EXPECT_NEAR(clock.drift(), -bus.drift, 15e-6);
  EXPECT_EQ(clock.jumps(), 0);
  RecordProperty("worst_settled_us", static_cast<int>(worst_settled / 1000));
}

TEST(DeviceClock, StampsOfTwoStreamsMayArriveOutOfOrder) {
  Bus bus;
  bus.first_tick = (1ull << 32) - 1000;
  DeviceClock clock(kTicks_per_s);
  for (int frame = 0; frame < 300; ++frame) {
    const double t_s = frame / 30.0;
    ASSERT_TRUE(clock.add(bus.ticks_at(t_s + 0.010), bus.right(t_s + 0.010)));
    ASSERT_TRUE(clock.add(bus.ticks_at(t_s), bus.right(t_s) + 11 * kMillisecond));
    EXPECT_NEAR(static_cast<double>(clock.to_local(bus.ticks_at(t_s)) - bus.right(t_s)), 0.0, 1e5) << frame;
  }
}

TEST(DeviceClock, MinutesOfSilenceDoNotLoseAWrap) {
  Bus bus;
  bus.drift = 20e-6;
  DeviceClock clock(kTicks_per_s);
  for (int frame = 0; frame < 3000; ++frame) clock.add(bus.ticks_at(frame / 30.0), bus.arrival(frame / 30.0));
  const double later_s = 100 + 200;  // nearly three wraps on
  ASSERT_TRUE(clock.add(bus.ticks_at(later_s), bus.right(later_s)));
  EXPECT_NEAR(static_cast<double>(clock.to_local(bus.ticks_at(later_s)) - bus.right(later_s)), 0.0, 5e6);
}

TEST(DeviceClock, OneWildStampIsSetAsideAJumpedCounterIsTaken) {
  Bus bus;
  DeviceClock clock(kTicks_per_s);
  for (int frame = 0; frame < 600; ++frame) clock.add(bus.ticks_at(frame / 30.0), bus.arrival(frame / 30.0));
  EXPECT_FALSE(clock.add(bus.ticks_at(20.0) + 600'000'000, bus.right(20.0)));  // 10 s ahead
  EXPECT_FALSE(clock.add(bus.ticks_at(20.0) - 600'000'000, bus.right(20.0)));  // 10 s behind
  EXPECT_TRUE(clock.add(bus.ticks_at(20.033), bus.right(20.033)));
  EXPECT_EQ(clock.jumps(), 0);

  bus.first_tick += 1'234'567'890;
  int refused = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const double t_s = 20.1 + frame / 30.0;
    refused += clock.add(bus.ticks_at(t_s), bus.right(t_s)) ? 0 : 1;
  }
  EXPECT_EQ(refused, DeviceClock::kJumpAfter - 1);
  EXPECT_EQ(clock.jumps(), 1);
  EXPECT_NEAR(static_cast<double>(clock.to_local(bus.ticks_at(22.0)) - bus.right(22.0)), 0.0, 1e6);
}

/// The process was stopped for a second: a burst of late arrivals, each less late, is neither a jump nor believed.
TEST(DeviceClock, ABurstAfterAStandstillMovesNothing) {
  Bus bus;
  DeviceClock clock(kTicks_per_s);
  for (int frame = 0; frame < 600; ++frame) clock.add(bus.ticks_at(frame / 30.0), bus.arrival(frame / 30.0));
  for (int frame = 600; frame < 630; ++frame) clock.add(bus.ticks_at(frame / 30.0), bus.right(21.0));
  EXPECT_EQ(clock.jumps(), 0);
  EXPECT_NEAR(static_cast<double>(clock.to_local(bus.ticks_at(21.0)) - bus.right(21.0)), 0.0, 2e6);
}

}  // namespace
}  // namespace wasp::drivers
