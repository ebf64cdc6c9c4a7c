#include "vision/kernels/similarity_fit.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/synthetic_flow.h"

namespace wasp::vision {
namespace {

using namespace test;

TEST(SimilarityFit, RecoversRandomMotionsExactly) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> angle(-0.1f, 0.1f), log_scale(-0.05f, 0.05f), shift(-10.f, 10.f);
  for (int run = 0; run < 200; ++run) {
    const float a = angle(random), s = log_scale(random), tu = shift(random), tv = shift(random);
    const auto fit = fit_similarity({}, make_flow(similarity(a, std::exp(s), tu, tv)));
    ASSERT_TRUE(fit.valid);
    EXPECT_NEAR(fit.rotation_rad, a, 2e-6f);
    EXPECT_NEAR(fit.log_scale, s, 2e-6f);
    EXPECT_NEAR(fit.shift_u_px, tu, 1e-3f);
    EXPECT_NEAR(fit.shift_v_px, tv, 1e-3f);
    EXPECT_EQ(fit.inliers, 108);
  }
}

TEST(SimilarityFit, ThirtyPercentOutliersAndNoiseStayWithinFourOfItsOwnSigmas) {
  int within = 0, runs = 300;
  for (int run = 0; run < runs; ++run) {
    auto flow = make_flow(similarity(0.02f, 1.01f, 3.f, -2.f), 0.1f, static_cast<unsigned>(run));
    spoil(flow, 0.3f, static_cast<unsigned>(run) + 1000u);
    const auto fit = fit_similarity({}, flow);
    ASSERT_TRUE(fit.valid) << run;
    EXPECT_NEAR(fit.rotation_rad, 0.02f, 4e-4f);
    EXPECT_NEAR(fit.log_scale, std::log(1.01f), 4e-4f);
    within += std::abs(fit.rotation_rad - 0.02f) < 4.f * fit.rotation_sigma_rad ? 1 : 0;
  }
  EXPECT_GE(within, runs * 99 / 100);
}

TEST(SimilarityFit, NoAgreementFewCellsOrOneSpotIsInvalid) {
  auto noise = make_flow(similarity(0.f, 1.f, 0.f, 0.f));
  spoil(noise, 1.1f, 5);
  EXPECT_FALSE(fit_similarity({}, noise).valid);
  auto few = make_flow(similarity(0.f, 1.f, 1.f, 0.f));
  for (int i = 7; i < few.count(); ++i) few.cells[static_cast<std::size_t>(i)].valid = 0;
  EXPECT_FALSE(fit_similarity({}, few).valid);
  auto spot = make_flow(similarity(0.f, 1.f, 1.f, 0.f));
  for (auto& cell : spot.cells) cell.x_px = 100.f, cell.y_px = 50.f;
  EXPECT_FALSE(fit_similarity({}, spot).valid);
}

TEST(SimilarityFit, BadInput) {
  auto flow = make_flow(similarity(0.01f, 1.f, 1.f, 0.f));
  flow.at(3, 3).u_px = std::numeric_limits<float>::quiet_NaN();
  flow.at(4, 3).x_px = std::numeric_limits<float>::infinity();
  const auto fit = fit_similarity({}, flow);
  EXPECT_TRUE(fit.valid);
  EXPECT_EQ(fit.cells, 106);
  for (const auto& [columns, rows] : {std::pair{0, 9}, {-1, 9}, {17, 9}, {12, 1000}}) {
    flow.columns = columns, flow.rows = rows;
    EXPECT_FALSE(fit_similarity({}, flow).valid);
  }
  EXPECT_FALSE(fit_similarity({.inlier_px = 0.f}, make_flow(similarity(0.f, 1.f, 1.f, 0.f))).valid);
  EXPECT_FALSE(fit_similarity({}, FlowField{}).valid);
}

TEST(SimilarityFit, DoesNotAllocate) {
  const auto flow = make_flow(similarity(0.01f, 1.02f, 1.f, 0.f), 0.1f);
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    EXPECT_TRUE(fit_similarity({}, flow).valid);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
