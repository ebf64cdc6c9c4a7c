// Wake-ups: what cyclictest prints, what a skipped release counts, and our own loop on this machine.
#include <gtest/gtest.h>

#include <cmath>

#include "rt/clock.h"
#include "tools/cyclictest.h"
#include "tools/quantiles.h"
#include "tools/wakeup_loop.h"

namespace wasp::tools {
namespace {

constexpr DurationNs kPeriod = 50 * kMillisecond;

TEST(Quantiles, AreNearestRanksOfEverySample) {
  std::vector<std::int64_t> samples;
  for (int i = 1; i <= 1000; ++i) samples.push_back(i);
  const Quantiles q = quantiles(samples);
  EXPECT_EQ(q.count, 1000u);
  EXPECT_EQ(q.p50, 500);
  EXPECT_EQ(q.p99, 990);
  EXPECT_EQ(q.p999, 999);
  EXPECT_EQ(q.max, 1000);
  EXPECT_EQ(quantiles({}).count, 0u);
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 2, 3}), 2.5);
  EXPECT_TRUE(std::isnan(median({})));
}

TEST(Population, AStallCountsEveryReleaseItSwallowed) {
  // Due at 0 and served 130 ms late: the releases due at 50 and 100 ms were waited for 80 and 30 ms.
  const std::vector<Wakeup> served = {{0, 130 * kMillisecond}, {150 * kMillisecond, 10 * kMicrosecond}};
  const Population all = whole_population(served, kPeriod);
  EXPECT_EQ(all.late_ns,
            (std::vector<std::int64_t>{130 * kMillisecond, 80 * kMillisecond, 30 * kMillisecond, 10 * kMicrosecond}));
  EXPECT_EQ(all.skipped, 2u);
  EXPECT_EQ(all.unobserved, 0u);
}

TEST(Population, WorkThatOverranCountsLikeALateWakeUp) {
  const std::vector<Wakeup> served = {{0, 1000, 120 * kMillisecond}, {150 * kMillisecond, 1000, kNever}};
  const Population all = whole_population(served, kPeriod);
  EXPECT_EQ(all.late_ns, (std::vector<std::int64_t>{1000, 70 * kMillisecond, 20 * kMillisecond, 1000}));
}

TEST(Population, ASampleTheObserverLostIsNoLatency) {
  const std::vector<Wakeup> served = {{0, 1000, 2000}, {100 * kMillisecond, 1000, kNever}};
  const Population all = whole_population(served, kPeriod);
  EXPECT_EQ(all.late_ns.size(), 2u);
  EXPECT_EQ(all.skipped, 0u);
  EXPECT_EQ(all.unobserved, 1u);
}

TEST(Population, PercentilesFeelTheStall) {
  std::vector<Wakeup> served;
  for (int i = 0; i < 97; ++i) served.push_back({i * kPeriod, 10 * kMicrosecond});
  served.push_back({97 * kPeriod, 130 * kMillisecond});
  served.push_back({100 * kPeriod, 10 * kMicrosecond});
  std::vector<std::int64_t> naive;
  for (const auto& w : served) naive.push_back(w.late_ns);
  EXPECT_EQ(quantiles(naive).count, 99u);
  const Quantiles q = quantiles(whole_population(served, kPeriod).late_ns);
  EXPECT_EQ(q.count, 101u);
  EXPECT_EQ(q.p99, 80e6);  // the naive one would say 10 us if the stall were one sample in more than a hundred
}

CyclictestSpec spec() {
  CyclictestSpec s;
  s.cores = {1};
  s.phase_ns = 12 * kMillisecond;
  s.period_ns = kPeriod;
  return s;
}

TEST(Cyclictest, EveryLineIsAWakeUpAtItsInstant) {
  CyclictestReader reader(spec());
  const TimeNs second = 1000 * kSecond;
  reader.take("Max CPUs = 2\n# /dev/cpu_dma_latency set to 0us\nThread 0 Interval: 50500\n       0:    ", second);
  reader.take("   0:   24852\n       0:       1:   22398\nT: 0 ( 3490) P:81 I:50000 C:     20 Min:  19652\n",
              second + 2 * kPeriod + 20 * kMillisecond);
  const auto all = reader.wakeups();
  ASSERT_EQ(all.size(), 1u);
  ASSERT_EQ(all.at(0).size(), 2u);
  EXPECT_EQ(all.at(0)[0].due_at_ns, second + 12 * kMillisecond + kPeriod);
  EXPECT_EQ(all.at(0)[0].late_ns, 24852);
  EXPECT_EQ(all.at(0)[1].due_at_ns, second + 12 * kMillisecond + 2 * kPeriod);
  EXPECT_TRUE(reader.complaints().empty());
}

TEST(Cyclictest, ItsSkippedReleasesAreCountedTheWayItSkipsThem) {
  CyclictestReader reader(spec());
  const TimeNs second = 1000 * kSecond;
  reader.take("0:0:130000000\n0:1:5000\n", second + 5 * kPeriod);
  const auto served = reader.wakeups().at(0);
  EXPECT_EQ(served[1].due_at_ns - served[0].due_at_ns, 3 * kPeriod);
  EXPECT_EQ(whole_population(served, kPeriod).late_ns.size(), 4u);
}

TEST(Cyclictest, WhatItComplainsOfIsKept) {
  CyclictestReader reader(spec());
  reader.take("Unable to change scheduling policy!\nprobably missing capabilities\n", 5);
  EXPECT_NE(reader.complaints().find("Unable to change"), std::string::npos);
  EXPECT_TRUE(reader.wakeups().empty());
}

TEST(WakeupLoop, ServesItsGrid) {
  const TimeNs first = rt::now() + 5 * kMillisecond;
  WakeupLoop loop({rt::nearest_usable_core(0), 0, kMillisecond, first, 20});
  rt::sleep_until(first + 300 * kMillisecond);
  const auto wakeups = loop.finish();
  ASSERT_FALSE(wakeups.empty());
  EXPECT_LE(wakeups.size(), 20u);
  for (const auto& w : wakeups) {
    EXPECT_EQ((w.due_at_ns - first) % kMillisecond, 0);
    EXPECT_GE(w.late_ns, 0);
  }
}

}  // namespace
}  // namespace wasp::tools
