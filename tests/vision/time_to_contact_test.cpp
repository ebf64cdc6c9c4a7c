#include "vision/kernels/time_to_contact.h"

#include <gtest/gtest.h>

#include <limits>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/synthetic_flow.h"

namespace wasp::vision {
namespace {

using namespace test;

constexpr float kFoeX = 300.f, kFoeY = 250.f;

/// A frontal surface that will be reached `frames` after the second frame.
FlowField approach(float frames, float noise_px, unsigned seed = 1) {
  return make_flow(similarity(0.f, 1.f + 1.f / frames, 0.f, 0.f, kFoeX, kFoeY), noise_px, seed);
}

TEST(TimeToContact, AllThreeWaysAgreeWithTheGeometry) {
  for (const float kappa : {0.f, 1.f})
    for (const float frames : {5.f, 30.f, 100.f}) {
      const auto flow = approach(frames, 0.f);
      const auto map =
          log_polar_geometry({.kappa = kappa, .reach = LogPolarReach::kFarthestCorner}, 640, 480, kFoeX, kFoeY);
      const auto fit = fit_similarity({}, flow);
      for (const auto& ttc : {contact_from_rings({}, flow, kFoeX, kFoeY), contact_from_log_polar({}, flow, map),
                              contact_from_scale({}, fit.log_scale, fit.log_scale_sigma, 1)}) {
        ASSERT_TRUE(ttc.valid) << frames;
        EXPECT_NEAR(ttc.frames, frames, 0.002f * frames + 0.001f);
      }
    }
}

TEST(TimeToContact, NoiseAndOutliersStayWithinAFewSigma) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    auto flow = approach(40.f, 0.2f, seed);
    spoil(flow, 0.2f, seed + 7u);
    const auto ttc = contact_from_rings({}, flow, kFoeX, kFoeY);
    ASSERT_TRUE(ttc.valid);
    EXPECT_LT(std::abs(ttc.growth_per_frame - 1.f / 40.f), 5.f * ttc.growth_sigma);
    EXPECT_NEAR(ttc.frames, 40.f, 2.f);
  }
}

TEST(TimeToContact, EveryRingSeesTheSameContact) {
  ContactRings rings;
  ASSERT_TRUE(contact_from_rings({}, approach(50.f, 0.f), kFoeX, kFoeY, &rings).valid);
  int filled = 0;
  for (const ContactRing& ring : rings) {
    if (ring.cells == 0) continue;
    ++filled;
    EXPECT_NEAR(ring.frames, 50.f, 0.1f);
    EXPECT_NEAR(ring.radial_flow, ring.radius / 50.f, 0.05f);
  }
  EXPECT_EQ(filled, 8);
}

TEST(TimeToContact, StillImageHasNone) {
  int alarms = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const auto flow = make_flow(similarity(0.f, 1.f, 0.f, 0.f), 0.05f, seed);
    alarms += contact_from_rings({}, flow, kFoeX, kFoeY).valid ? 1 : 0;
    const auto fit = fit_similarity({}, flow);
    alarms += contact_from_scale({}, fit.log_scale, fit.log_scale_sigma, 1).valid ? 1 : 0;
  }
  EXPECT_LE(alarms, 2);
}

TEST(TimeToContact, RecedingIsNegative) {
  const auto ttc = contact_from_rings({}, approach(-40.f, 0.f), kFoeX, kFoeY);
  ASSERT_TRUE(ttc.valid);
  EXPECT_NEAR(ttc.frames, -40.f, 0.1f);
}

TEST(ContactWindow, UniformApproachIsExactOverAnyWindow) {
  for (const int window : {1, 5, 10}) {
    ContactWindow contact(window);
    for (int frame = 1; frame <= 60; ++frame) {
      const float left = 100.f - static_cast<float>(frame);  // frames to contact after this one
      const SimilarityFit fit{.valid = true, .log_scale = std::log((left + 1.f) / left), .log_scale_sigma = 1e-5f};
      const auto ttc = contact.add(fit);
      EXPECT_EQ(ttc.valid, frame >= window);
      if (!ttc.valid) continue;
      EXPECT_NEAR(ttc.frames, left, 0.01f);
    }
    contact.add({});  // a gap: the history starts again
    EXPECT_EQ(contact.add({.valid = true, .log_scale = 0.02f, .log_scale_sigma = 1e-5f}).valid, window == 1);
  }
}

TEST(TimeToContact, BadInput) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto flow = approach(30.f, 0.f);
  EXPECT_FALSE(contact_from_rings({}, FlowField{}, 1.f, 1.f).valid);
  EXPECT_FALSE(contact_from_rings({}, flow, nan, 1.f).valid);
  EXPECT_FALSE(contact_from_rings({.flow_sigma_px = 0.f}, flow, kFoeX, kFoeY).valid);
  EXPECT_FALSE(contact_from_log_polar({}, flow, {}).valid);
  EXPECT_FALSE(contact_from_scale({}, nan, 0.1f, 1).valid);
  EXPECT_FALSE(contact_from_scale({}, 0.1f, nan, 1).valid);
  EXPECT_FALSE(contact_from_scale({}, 0.1f, 0.01f, 0).valid);
  ContactRings rings;
  contact_from_rings({.rings = 1000}, flow, kFoeX, kFoeY, &rings);
  contact_from_rings({.rings = -3}, flow, kFoeX, kFoeY, &rings);
  ContactWindow window(-5);
  EXPECT_FALSE(window.add({.valid = true, .log_scale = nan}).valid);
}

TEST(TimeToContact, DoesNotAllocate) {
  const auto flow = approach(30.f, 0.1f);
  const auto map = log_polar_geometry({}, 640, 480, kFoeX, kFoeY);
  const auto fit = fit_similarity({}, flow);
  ContactRings rings;
  ContactWindow window(3);
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    EXPECT_TRUE(contact_from_rings({}, flow, kFoeX, kFoeY, &rings).valid);
    EXPECT_TRUE(contact_from_log_polar({}, flow, map, &rings).valid);
    EXPECT_TRUE(contact_from_scale({}, fit.log_scale, fit.log_scale_sigma, 1).valid);
    for (int frame = 0; frame < 5; ++frame) (void)window.add(fit);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
