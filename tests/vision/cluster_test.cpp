#include "vision/kernels/cluster.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"

namespace wasp::vision {
namespace {

struct Points {
  std::vector<float> x, y;
};

/// `count` points about `k` centres 10 apart on a line, in turn.
Points blobs(int count, int k, float spread, std::mt19937& random) {
  std::normal_distribution<float> noise(0.f, spread);
  Points p;
  for (int i = 0; i < count; ++i) {
    p.x.push_back(10.f * static_cast<float>(i % k) + noise(random));
    p.y.push_back(-5.f * static_cast<float>(i % k) + noise(random));
  }
  return p;
}

TEST(Cluster, FindsSeparateBlobsForEveryKAndSize) {
  std::mt19937 random(1);
  for (int k = 1; k <= kMaxClusters; ++k)
    for (const int count : {8, 15, 16, 17, 108, kMaxObservations}) {
      const Points p = blobs(count, k, 0.5f, random);
      const Clusters c = cluster_points({.clusters = k, .restarts = 8}, p.x, p.y);
      ASSERT_TRUE(c.valid);
      ASSERT_EQ(c.count, k);
      for (int i = 0; i < count; ++i) EXPECT_EQ(c.label[static_cast<std::size_t>(i)], i % k) << k << " " << count;
      for (int i = 0; i < k; ++i)
        EXPECT_NEAR(c.cluster[static_cast<std::size_t>(i)].x, 10.f * static_cast<float>(i), 1.f);
    }
}

/// What must hold whatever the points: sizes add up, labels agree with the nearest mean, the sum of squares is right.
void expect_consistent(const Clusters& c, const Points& p) {
  ASSERT_TRUE(c.valid);
  std::array<int, kMaxClusters> sizes{};
  double compactness = 0;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const auto distance2 = [&](const Cluster& m) { return std::pow(p.x[i] - m.x, 2) + std::pow(p.y[i] - m.y, 2); };
    const Cluster& mine = c.cluster[c.label[i]];
    ++sizes[c.label[i]];
    compactness += distance2(mine);
    for (int j = 0; j < c.count; ++j)
      if (const Cluster& other = c.cluster[static_cast<std::size_t>(j)]; other.size > 0) {
        EXPECT_LE(distance2(mine), distance2(other) * 1.0001 + 1e-5);
      }
  }
  for (std::size_t j = 0; j < static_cast<std::size_t>(c.count); ++j) EXPECT_EQ(sizes[j], c.cluster[j].size);
  EXPECT_NEAR(c.compactness, compactness, 1e-4 * compactness + 1e-6);
}

TEST(Cluster, IsConsistentAndEqualsTheReferenceOnRandomPoints) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(-3.f, 3.f);
  for (int run = 0; run < 300; ++run) {
    Points p =
        blobs(1 + static_cast<int>(random() % kMaxObservations), 1 + static_cast<int>(random() % 5), 2.f, random);
    if (run % 3 == 0)
      for (float& x : p.x) x = uniform(random);
    const ClusterParams params{.clusters = 1 + static_cast<int>(random() % kMaxClusters),
                               .seed = static_cast<std::uint32_t>(random())};
    const Clusters c = cluster_points(params, p.x, p.y), plain = cluster_points_reference(params, p.x, p.y);
    expect_consistent(c, p);
    EXPECT_NEAR(c.compactness, plain.compactness, 0.2f * plain.compactness + 1e-4f);
    EXPECT_LE(c.iterations, params.restarts * params.max_iterations);
  }
}

TEST(Cluster, EqualInputGivesEqualOutput) {
  std::mt19937 random(3);
  const Points p = blobs(108, 3, 4.f, random);
  const Clusters a = cluster_points({}, p.x, p.y), b = cluster_points({}, p.x, p.y);
  EXPECT_EQ(a.label, b.label);
  EXPECT_EQ(a.compactness, b.compactness);
}

TEST(Cluster, FewerDifferentPointsThanClusters) {
  const Points same{std::vector<float>(20, 2.f), std::vector<float>(20, -1.f)};
  const Clusters c = cluster_points({}, same.x, same.y);
  ASSERT_TRUE(c.valid);
  EXPECT_EQ(c.compactness, 0.f);
  EXPECT_EQ(c.cluster[0].size, 20);
  EXPECT_EQ(c.cluster[1].size, 0);
  const std::vector<float> one{4.f};
  EXPECT_EQ(cluster_points({}, one, one).count, 1);
}

TEST(Cluster, RefusesBadInput) {
  const std::vector<float> good(10, 1.f), few(9, 1.f), many(kMaxObservations + 1, 1.f);
  EXPECT_FALSE(cluster_points({}, {}, {}).valid);
  EXPECT_FALSE(cluster_points({}, good, few).valid);
  EXPECT_FALSE(cluster_points({}, many, many).valid);
  for (const ClusterParams& bad : {ClusterParams{.clusters = 0}, ClusterParams{.clusters = kMaxClusters + 1},
                                   ClusterParams{.restarts = 0}, ClusterParams{.max_iterations = 101}})
    EXPECT_FALSE(cluster_points(bad, good, good).valid);
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity(), -2e9f}) {
    std::vector<float> x = good;
    x[7] = bad;
    EXPECT_FALSE(cluster_points({}, x, good).valid);
    EXPECT_FALSE(cluster_points({}, good, x).valid);
  }
}

TEST(Cluster, AllocatesNothing) {
  std::mt19937 random(4);
  const Points p = blobs(108, 3, 4.f, random);
  const test::MallocCount count;
  {
    const rt::RealtimeSection section;
    EXPECT_TRUE(cluster_points({}, p.x, p.y).valid);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
