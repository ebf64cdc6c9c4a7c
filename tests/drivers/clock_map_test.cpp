// The clock map on simulated exchanges: offset and drift through jitter, outliers, reboot, nonsense.
#include "drivers/clock_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace wasp::drivers {
namespace {

/// An autopilot whose clock runs `drift` fast and started at another time; both ways of the line take at least 1 ms,
/// plus an exponential queueing delay each.
struct SimulatedLine {
  double drift = 0;
  DurationNs start_offset_ns = -1'000 * kSecond;
  double mean_jitter_ns = 0.5e6;
  std::mt19937 random{5};

  TimeNs remote(TimeNs local_ns) const {
    return local_ns + start_offset_ns + static_cast<DurationNs>(drift * static_cast<double>(local_ns));
  }
  DurationNs delay() {
    std::exponential_distribution<double> queue(1.0 / mean_jitter_ns);
    return kMillisecond + static_cast<DurationNs>(queue(random));
  }
  ClockExchange exchange(TimeNs sent_at_ns) {
    const TimeNs there = sent_at_ns + delay();
    return {sent_at_ns, remote(there), there + delay()};
  }
};

constexpr TimeNs kStart = 5'000 * kSecond;

TEST(ClockMap, IsSyncedAfterThreeExchanges) {
  SimulatedLine line;
  line.mean_jitter_ns = 1;
  ClockMap map;
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(map.synced());
    EXPECT_EQ(map.add(line.exchange(kStart + i * 100 * kMillisecond)), ClockOutcome::kAccepted);
  }
  EXPECT_TRUE(map.synced());
  EXPECT_NEAR(static_cast<double>(map.to_local(line.remote(kStart))), static_cast<double>(kStart), 1000);
  EXPECT_NEAR(static_cast<double>(map.to_remote(kStart)), static_cast<double>(line.remote(kStart)), 1000);
}

/// 10 Hz for ten minutes, queueing of 0.5 ms on average, 80 ppm drift: a bare halfway estimate scatters by half a
/// millisecond and an offset without drift would be 48 ms off at the end.
TEST(ClockMap, FollowsDriftThroughJitter) {
  for (const double drift : {80e-6, -80e-6, 0.0}) {
    SimulatedLine line;
    line.drift = drift;
    ClockMap map;
    double worst_ns = 0;
    for (int i = 0; i < 6000; ++i) {
      const TimeNs sent = kStart + i * 100 * kMillisecond;
      map.add(line.exchange(sent));
      if (i < 1000) continue;
      const TimeNs instant = sent + 37 * kMillisecond;
      worst_ns = std::max(worst_ns, std::abs(static_cast<double>(map.to_local(line.remote(instant)) - instant)));
    }
    EXPECT_LT(worst_ns, 0.4e6) << drift;
    EXPECT_NEAR(map.drift(), drift, 60e-6);
    std::printf("[ measured ] drift %+.0f ppm: worst error %.0f us after 100 s, drift found %+.0f ppm\n", drift * 1e6,
                worst_ns * 1e-3, map.drift() * 1e6);
  }
}

TEST(ClockMap, SetsLongRoundTripsAside) {
  SimulatedLine line;
  line.mean_jitter_ns = 1;
  ClockMap map;
  for (int i = 0; i < 10; ++i) map.add(line.exchange(kStart + i * kSecond));
  const auto before = map.offset_at(kStart + 20 * kSecond);
  ClockExchange late = line.exchange(kStart + 20 * kSecond);
  late.received_at_ns += 8 * kMillisecond;  // a one-sided delay would move the offset by 4 ms
  EXPECT_EQ(map.add(late), ClockOutcome::kTooSlow);
  EXPECT_EQ(map.offset_at(kStart + 20 * kSecond), before);
}

TEST(ClockMap, ASingleOutlierMovesNothing) {
  SimulatedLine line;
  line.mean_jitter_ns = 1;
  ClockMap map;
  for (int i = 0; i < 10; ++i) map.add(line.exchange(kStart + i * kSecond));
  const TimeNs later = kStart + 11 * kSecond;
  const auto before = map.offset_at(later);
  ClockExchange wrong = line.exchange(later);
  wrong.remote_ns += 50 * kMillisecond;
  EXPECT_EQ(map.add(wrong), ClockOutcome::kOutlier);
  EXPECT_EQ(map.add(wrong), ClockOutcome::kOutlier);
  EXPECT_EQ(map.offset_at(later), before);
  EXPECT_EQ(map.add(line.exchange(later + kSecond)), ClockOutcome::kAccepted);
  EXPECT_EQ(map.add(wrong), ClockOutcome::kOutlier) << "agreement starts over";
}

TEST(ClockMap, StartsAnewAfterAReboot) {
  SimulatedLine line;
  ClockMap map;
  for (int i = 0; i < 100; ++i) map.add(line.exchange(kStart + i * 100 * kMillisecond));
  ASSERT_TRUE(map.synced());
  const TimeNs reboot = kStart + 20 * kSecond;
  line.start_offset_ns = -reboot;  // their clock begins at zero
  int exchanges = 0;
  ClockOutcome outcome = ClockOutcome::kOutlier;
  while (outcome != ClockOutcome::kRestarted && exchanges < 50)
    outcome = map.add(line.exchange(reboot + ++exchanges * 100 * kMillisecond));
  EXPECT_EQ(outcome, ClockOutcome::kRestarted);
  EXPECT_LT(exchanges, 30);
  EXPECT_FALSE(map.synced());
  for (int i = 0; i < 100; ++i) map.add(line.exchange(reboot + (60 + i) * 100 * kMillisecond));
  const TimeNs instant = reboot + 17 * kSecond;
  EXPECT_TRUE(map.synced());
  EXPECT_NEAR(static_cast<double>(map.to_local(line.remote(instant)) - instant), 0, 1e6);
}

/// A day in the life of a bad line: 40 ppm of drift that wanders, 0.5 ms of queueing each way, one exchange in twenty
/// held up for up to 80 ms (a host that stalls), one in fifty answered with a wrong time, the way back 0.6 ms longer
/// than the way there, and a reboot in the middle. Error percentiles of mapping an instant between exchanges, ten
/// seconds after the start and after the reboot. What no exchange can tell is half the difference of the two ways.
TEST(ClockMap, ErrorPercentilesOnABadLine) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    SimulatedLine line;
    line.random.seed(seed);
    constexpr DurationNs kLongerBack = 600 * kMicrosecond;
    std::uniform_real_distribution<double> uniform(0, 1);
    ClockMap map;
    std::vector<double> errors_us;
    double wander = 0;  // phase of their clock that 40 ppm do not explain [ns]
    int restarts = 0, settled_after = 100;
    for (int i = 0; i < 12'000; ++i) {
      const TimeNs sent = kStart + i * 100 * kMillisecond;
      line.drift = 40e-6;
      wander += 500 * std::sin(i / 900.0);  // up to 5 ppm
      if (i == 6000) line.start_offset_ns = -sent, settled_after = i + 100;
      const auto theirs = [&](TimeNs t) { return line.remote(t) + static_cast<DurationNs>(wander); };
      const TimeNs there = sent + line.delay();
      ClockExchange e{sent, theirs(there), there + line.delay() + kLongerBack};
      if (uniform(line.random) < 0.05) e.received_at_ns += static_cast<DurationNs>(80e6 * uniform(line.random));
      if (uniform(line.random) < 0.02) e.remote_ns += static_cast<DurationNs>(1e9 * (uniform(line.random) - 0.3));
      restarts += map.add(e) == ClockOutcome::kRestarted ? 1 : 0;
      const TimeNs instant = sent + static_cast<DurationNs>(100e6 * uniform(line.random));
      if (i > settled_after && map.synced())
        errors_us.push_back(std::abs(static_cast<double>(map.to_local(theirs(instant)) - instant)) * 1e-3);
    }
    std::sort(errors_us.begin(), errors_us.end());
    const auto at = [&](double share) {
      return errors_us[static_cast<std::size_t>(share * static_cast<double>(errors_us.size() - 1))];
    };
    std::printf("[ measured ] seed %u: error p50 %.0f p95 %.0f p99 %.0f p99.9 %.0f max %.0f us, %d restart\n", seed,
                at(0.5), at(0.95), at(0.99), at(0.999), at(1), restarts);
    EXPECT_EQ(restarts, 1);
    EXPECT_GT(errors_us.size(), 11'000u);
    EXPECT_LT(at(0.5), 500);  // 300 us of them are the two ways' difference
    EXPECT_LT(at(0.99), 1000);
    EXPECT_LT(at(1), 2000);
  }
}

TEST(ClockMap, RefusesNonsense) {
  ClockMap map;
  EXPECT_EQ(map.add({kStart, 1, kStart - 1}), ClockOutcome::kMalformed);
  EXPECT_EQ(map.add({kStart, 1, kStart + 2 * kSecond}), ClockOutcome::kMalformed);
  EXPECT_EQ(map.add({kStart, -1, kStart + 1}), ClockOutcome::kMalformed);
  EXPECT_EQ(map.add({kStart, INT64_MAX, kStart + 1}), ClockOutcome::kMalformed);
  EXPECT_FALSE(map.synced());
}

}  // namespace
}  // namespace wasp::drivers
