#include "drivers/exposure_pairs.h"

#include <gtest/gtest.h>

#include <vector>

namespace wasp::drivers {
namespace {

constexpr DurationNs kPeriod = kSecond / 30;

/// Plays both sensors for n periods, grey `skew_ns` after depth; how the pairs come out.
PairCounts play(DurationNs skew_ns, int n, std::vector<std::uint32_t>* depth = nullptr,
                std::vector<std::uint32_t>* gray = nullptr) {
  ExposurePairs pairs(kPeriod, true);
  const auto add_depth = [&](TimeNs at_ns) {
    const ExposureStamp d = pairs.add_depth(at_ns);
    if (depth != nullptr) depth->push_back(d.sequence);
    if (const auto g = pairs.take_waiting(); g && gray != nullptr) gray->push_back(g->sequence);
  };
  const auto add_gray = [&](TimeNs at_ns) {
    if (const auto g = pairs.take_waiting(); g && gray != nullptr) gray->push_back(g->sequence);
    if (const auto g = pairs.add_gray(at_ns); g && gray != nullptr) gray->push_back(g->sequence);
  };
  for (int i = 0; i < n; ++i) {
    const TimeNs d = kSecond + i * kPeriod, g = d + skew_ns;
    if (skew_ns < 0) add_gray(g);
    add_depth(d);
    if (skew_ns >= 0) add_gray(g);
  }
  return pairs.counts();
}

TEST(ExposurePairs, AnyPhaseOfTheTwoSensorsMakesPairs) {
  for (const double share : {-0.5, -0.3, -0.01, 0.0, 0.2, 0.49, 0.5}) {
    std::vector<std::uint32_t> depth, gray;
    const auto skew_ns = static_cast<DurationNs>(share * static_cast<double>(kPeriod));
    const PairCounts counts = play(skew_ns, 20, &depth, &gray);
    EXPECT_EQ(counts.pairs, 20u) << share;
    EXPECT_EQ(counts.lone_gray + counts.lone_depth, 0u) << share;
    EXPECT_EQ(counts.skew_sum_ns, 20 * skew_ns) << share;
    EXPECT_EQ(depth, gray) << share;
  }
}

TEST(ExposurePairs, ALostImageLeavesAGapAndALoneOne) {
  ExposurePairs pairs(kPeriod, true);
  EXPECT_EQ(pairs.add_depth(0).sequence, 0u);
  EXPECT_EQ(pairs.add_gray(kPeriod / 10)->sequence, 0u);
  EXPECT_FALSE(pairs.add_gray(kPeriod + kPeriod / 10).has_value()) << "waits for its depth";
  const ExposureStamp late = pairs.add_depth(2 * kPeriod);
  EXPECT_EQ(late.sequence, 2u);
  EXPECT_FALSE(pairs.waits_for_newest());
  const auto alone = pairs.take_waiting();
  ASSERT_TRUE(alone.has_value());
  EXPECT_EQ(alone->sequence, 1u);
  EXPECT_EQ(alone->exposed_at_ns, kPeriod + kPeriod / 10);
  EXPECT_EQ(pairs.counts().lone_gray, 1u);
  EXPECT_EQ(pairs.add_depth(3 * kPeriod).sequence, 3u);
  EXPECT_EQ(pairs.counts().lone_depth, 1u);
}

TEST(ExposurePairs, ADepthSensorThatFellSilentIsNotWaitedFor) {
  ExposurePairs pairs(kPeriod, true);
  pairs.add_depth(0);
  pairs.add_gray(0);
  EXPECT_TRUE(pairs.add_gray(5 * kPeriod).has_value());
  EXPECT_FALSE(pairs.waiting());
}

TEST(ExposurePairs, GreyAloneCountsItself) {
  ExposurePairs pairs(kPeriod, false);
  for (std::uint32_t i = 0; i < 5; ++i) {
    const auto g = pairs.add_gray(i * kPeriod);
    ASSERT_TRUE(g.has_value());
    EXPECT_EQ(g->sequence, i);
  }
  EXPECT_EQ(pairs.counts().lone_gray, 0u) << "nothing is missing where no depth is wanted";
}

}  // namespace
}  // namespace wasp::drivers
