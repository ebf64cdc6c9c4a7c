#include "vision/kernels/edge_height.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

namespace wasp::vision {
namespace {

constexpr float kLambda = 1.5f;
const Vec3 kLevelUp(0.f, -1.f, 0.f), kDownUp(0.f, 0.f, -1.f);

/// Row histogram of a level camera over a Poisson floor: per column, edges at exponential gaps along the floor; a
/// second edge within `delta` rows of the last one seen is not seen (the thesis' own model, drawn at random).
std::unique_ptr<EdgeRows> level_rows(float height_m, const Intrinsics& k, float delta_px, unsigned seed) {
  auto rows = std::make_unique<EdgeRows>();
  rows->valid = true;
  rows->width_px = k.width_px, rows->height_px = k.height_px;
  std::mt19937 random(seed);
  std::exponential_distribution<float> gap(kLambda);
  const float v_max = static_cast<float>(k.height_px - 2) - k.cy_px;
  for (int u = 1; u < k.width_px - 1; ++u) {
    float last = 1e9f;
    for (float x = k.fy_px * height_m / v_max + gap(random); x < 200.f * height_m; x += gap(random)) {
      const float v = k.fy_px * height_m / x;
      if (last - v < delta_px) {
        last = v;  // an unseen edge hides the next one as well: P(no edge in the preceding interval)
        continue;
      }
      last = v;
      ++rows->count[static_cast<std::size_t>(std::lround(k.cy_px + v))];
      ++rows->total;
    }
  }
  return rows;
}

TEST(EdgeHeight, RecoversTheHeightOfASimulatedPoissonFloor) {
  const Intrinsics k;
  for (const float height_m : {0.5f, 1.f, 2.f, 4.f}) {
    const auto rows = level_rows(height_m, k, 2.f, 3);
    const EdgeHeight e = estimate_edge_height({.edges_per_m = kLambda}, k, kLevelUp, *rows);
    ASSERT_TRUE(e.valid) << height_m;
    EXPECT_EQ(e.model, EdgeModel::kDistribution);
    EXPECT_NEAR(e.height_m, height_m, 0.15f * height_m);
    EXPECT_LT(e.misfit, 0.1f);
  }
}

TEST(EdgeHeight, OnlyTheProductOfLambdaAndHeightIsSeen) {
  const Intrinsics k;
  const auto rows = level_rows(1.f, k, 2.f, 3);
  const EdgeHeight one = estimate_edge_height({.edges_per_m = kLambda}, k, kLevelUp, *rows);
  const EdgeHeight half = estimate_edge_height({.edges_per_m = 0.5f * kLambda}, k, kLevelUp, *rows);
  EXPECT_NEAR(one.edges_per_height, half.edges_per_height, 0.01f * one.edges_per_height);
}

TEST(EdgeHeight, CountModelInvertsItsOwnExpectation) {
  const Intrinsics k;
  for (const float height_m : {0.5f, 2.f, 8.f}) {
    EdgeRows rows;
    rows.valid = true;
    rows.width_px = k.width_px, rows.height_px = k.height_px;
    const float share = 2.5f * (1.f - std::exp(-kLambda * height_m / k.fy_px));
    for (int v = 1; v < k.height_px - 1; ++v)
      rows.count[static_cast<std::size_t>(v)] =
          static_cast<int>(std::lround(share * static_cast<float>(k.width_px - 2)));
    const EdgeHeight e = estimate_edge_height({.edges_per_m = kLambda, .min_edges = 1}, k, kDownUp, rows);
    ASSERT_TRUE(e.valid);
    EXPECT_EQ(e.model, EdgeModel::kCount);
    EXPECT_NEAR(e.height_m, height_m, 0.15f * height_m);  // counts are whole numbers
  }
}

TEST(EdgeHeight, BlindWithoutEdgesFloorRowsOrSense) {
  const Intrinsics k;
  const auto rows = level_rows(1.f, k, 2.f, 3);
  EXPECT_FALSE(estimate_edge_height({}, k, kLevelUp, EdgeRows{}).valid);
  EXPECT_FALSE(estimate_edge_height({.min_edges = 100'000'000}, k, kLevelUp, *rows).valid);
  EXPECT_FALSE(estimate_edge_height({}, k, {0.f, 0.f, 1.f}, *rows).valid);  // looking straight up
  EXPECT_FALSE(estimate_edge_height({.edges_per_m = std::nanf("")}, k, kLevelUp, *rows).valid);
  EXPECT_FALSE(estimate_edge_height({}, k, Vec3::Constant(std::nanf("")), *rows).valid);
  Intrinsics broken;
  broken.fy_px = -1.f;
  EXPECT_FALSE(estimate_edge_height({}, broken, kLevelUp, *rows).valid);
}

}  // namespace
}  // namespace wasp::vision
