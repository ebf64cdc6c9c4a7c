// Buckets over every edge, quantiles against sorted samples, the exact maximum, and a reader that looks while it grows.
#include "rt/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <thread>
#include <vector>

namespace wasp::rt {
namespace {

TEST(Histogram, BucketsAreMonotonicAndEachHoldsItsOwnValues) {
  for (std::size_t i = 0; i + 1 < Histogram::kBuckets; ++i) {
    const std::uint64_t low = Histogram::bucket_low(i), next = Histogram::bucket_low(i + 1);
    ASSERT_LT(low, next);
    ASSERT_EQ(Histogram::bucket_of(low), i);
    ASSERT_EQ(Histogram::bucket_of(next - 1), i);
    if (low >= 32) {
      ASSERT_LE(static_cast<double>(next - low) / static_cast<double>(low), 1.0 / 32);
    }
  }
  std::size_t last = 0;
  for (int bit = 2; bit < 64; ++bit)
    for (const std::uint64_t v : {(1ull << bit) - 1, 1ull << bit, (1ull << bit) + 1}) {
      const std::size_t bucket = Histogram::bucket_of(v);
      ASSERT_GE(bucket, last);
      ASSERT_LT(bucket, Histogram::kBuckets);
      last = bucket;
    }
}

std::vector<DurationNs> samples_of(int kind, std::mt19937_64& random) {
  std::vector<DurationNs> samples(20'000);
  std::lognormal_distribution<double> lognormal(9, 2);
  std::uniform_int_distribution<DurationNs> uniform(0, 5'000'000);
  for (auto& s : samples) {
    if (kind == 0) s = uniform(random);
    if (kind == 1) s = static_cast<DurationNs>(lognormal(random));
    if (kind == 2) s = random() % 1000 == 0 ? 900 * kSecond : 1500;  // two points far apart
  }
  return samples;
}

TEST(Histogram, QuantilesAgreeWithSortedSamples) {
  std::mt19937_64 random(1);
  for (int kind = 0; kind < 3; ++kind) {
    auto samples = samples_of(kind, random);
    const auto h = std::make_unique<Histogram>();
    double sum = 0;
    for (const auto s : samples) h->record(s), sum += static_cast<double>(s);
    std::sort(samples.begin(), samples.end());
    for (const double q : {0.001, 0.01, 0.1, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
      const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(samples.size()))) - 1;
      const auto exact = static_cast<double>(samples[rank]);
      EXPECT_NEAR(static_cast<double>(h->quantile_ns(q)), exact, 0.032 * exact + 1) << "kind " << kind << " q " << q;
    }
    EXPECT_EQ(h->max_ns(), samples.back());
    EXPECT_EQ(h->min_ns(), samples.front());
    EXPECT_EQ(h->count(), samples.size());
    EXPECT_NEAR(h->mean_ns(), sum / static_cast<double>(samples.size()), 1e-6 * h->mean_ns());
  }
}

TEST(Histogram, NoOutlierIsClampedAway) {
  Histogram h;
  for (int i = 0; i < 1000; ++i) h.record(100);
  constexpr DurationNs kTwoHours = 7200 * kSecond;  // beyond the last bucket's lower edge of 18 minutes
  h.record(kTwoHours);
  EXPECT_EQ(h.max_ns(), kTwoHours);
  EXPECT_EQ(h.quantile_ns(1.0), kTwoHours);
  h.record(INT64_MAX);
  EXPECT_EQ(h.max_ns(), INT64_MAX);
  EXPECT_EQ(h.quantile_ns(1.0), INT64_MAX);
  EXPECT_EQ(h.min_ns(), 100);
}

TEST(Histogram, NegativeCountsAsZeroAndEmptyIsZero) {
  Histogram h;
  EXPECT_EQ(h.quantile_ns(0.5), 0);
  EXPECT_EQ(h.min_ns(), 0);
  h.record(-5);
  EXPECT_EQ(h.count(), 1u);
  EXPECT_EQ(h.max_ns(), 0);
  EXPECT_EQ(h.quantile_ns(1.0), 0);
}

TEST(Histogram, ZeroedMemoryIsAnEmptyHistogram) {
  alignas(Histogram) static unsigned char memory[sizeof(Histogram)];  // as a fresh shared-memory block is
  auto* h = reinterpret_cast<Histogram*>(memory);
  h->record(500);
  h->record(700);
  EXPECT_EQ(h->min_ns(), 500);
  EXPECT_EQ(h->max_ns(), 700);
}

TEST(Histogram, ReaderMayLookWhileItIsWritten) {
  const auto h = std::make_unique<Histogram>();
  constexpr std::uint64_t kCount = 400'000;
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kCount; ++i) h->record(static_cast<DurationNs>(i));
  });
  std::uint64_t last_count = 0;
  DurationNs last_max = 0;
  while (last_count < kCount) {
    const std::uint64_t n = h->count();
    const DurationNs max = h->max_ns(), median = h->quantile_ns(0.5);
    ASSERT_GE(n, last_count);
    ASSERT_GE(max, last_max);
    ASSERT_GE(max, static_cast<DurationNs>(n));  // sample n has value n: what is counted is in the maximum
    ASSERT_LE(median, h->max_ns());
    last_count = n;
    last_max = max;
  }
  writer.join();
  std::uint64_t in_buckets = 0;
  for (std::size_t i = 0; i < Histogram::kBuckets; ++i) in_buckets += h->bucket(i);
  EXPECT_EQ(in_buckets, kCount);
}

}  // namespace
}  // namespace wasp::rt
