#include "vision/kernels/heading_rate.h"

#include <gtest/gtest.h>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/synthetic_flow.h"

namespace wasp::vision {
namespace {

using namespace test;

/// Flow of a level floor 2 m below a camera that looks straight down (image up = north = heading), derived from the
/// geometry alone: the camera turns by `yaw`, climbs to `ratio` times its height and moves by (north, east).
FlowField flow_over_floor(float yaw, float ratio, float north_m, float east_m) {
  const float f = 400.f, height = 2.f;
  return make_flow([=](float x, float y) {
    const float right = (x - 319.5f) / f * height, down = (y - 239.5f) / f * height;  // floor point, camera axes
    const float north = -down - north_m, east = right - east_m;                       // relative to the camera after
    const float new_right = -std::sin(yaw) * north + std::cos(yaw) * east;
    const float new_down = -(std::cos(yaw) * north + std::sin(yaw) * east);
    return Uv{319.5f + f * new_right / (ratio * height) - x, 239.5f + f * new_down / (ratio * height) - y};
  });
}

TEST(HeadingRate, SignsAndSizesFromGeometry) {
  for (const float yaw : {-0.1f, 0.f, 0.02f})
    for (const float ratio : {0.97f, 1.f, 1.05f}) {
      const auto rate = heading_from_fit(fit_similarity({}, flow_over_floor(yaw, ratio, 0.03f, -0.02f)));
      ASSERT_TRUE(rate.valid);
      EXPECT_NEAR(rate.yaw_rad, yaw, 1e-5f);
      EXPECT_NEAR(rate.height_ratio, ratio, 1e-5f);
      EXPECT_NEAR(climb_rate_mps(rate, 2.f, 0.1f), (ratio - 1.f) * 20.f, 1e-3f);
    }
}

TEST(HeadingRate, InvalidStaysInvalid) {
  EXPECT_FALSE(heading_from_fit({}).valid);
  EXPECT_EQ(climb_rate_mps({}, 2.f, 0.1f), 0.f);
  auto fit = fit_similarity({}, flow_over_floor(0.f, 1.f, 0.f, 0.f));
  ASSERT_TRUE(fit.valid);
  EXPECT_EQ(climb_rate_mps(heading_from_fit(fit), 2.f, 0.f), 0.f);
  fit.rotation_sigma_rad = 0.5f;
  EXPECT_FALSE(heading_from_fit(fit).valid);
}

TEST(HeadingRate, DoesNotAllocate) {
  const auto flow = flow_over_floor(0.02f, 1.01f, 0.f, 0.f);
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    EXPECT_GT(climb_rate_mps(heading_from_fit(fit_similarity({}, flow)), 2.f, 0.1f), 0.f);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
