#include "vision/kernels/foe.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <random>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/synthetic_flow.h"
#include "vision/kernels/derotate.h"

namespace wasp::vision {
namespace {

using namespace test;

/// Exact image motion of points at random depths (3 to 20 m) for a camera that moves by `step` and turns by `turn`.
FlowField flow_of_motion(const Vec3& step, const Vec3& turn, unsigned seed, float noise_px) {
  const Intrinsics k;
  auto random = std::make_shared<std::mt19937>(seed);
  const float angle = turn.norm();
  const Mat3 back =
      angle > 0.f ? Mat3(Eigen::AngleAxisf(-angle, turn / angle).toRotationMatrix()) : Mat3(Mat3::Identity());
  return make_flow(
      [=](float x, float y) {
        std::uniform_real_distribution<float> depth(3.f, 20.f);
        const Vec3 point = depth(*random) * Vec3((x - k.cx_px) / k.fx_px, (y - k.cy_px) / k.fy_px, 1.f);
        const Vec3 seen = back * (point - step);
        return Uv{k.fx_px * seen.x() / seen.z() + k.cx_px - x, k.fy_px * seen.y() / seen.z() + k.cy_px - y};
      },
      noise_px, seed);
}

Vec3 step_towards(float x_px, float y_px, float size_m) {
  const Intrinsics k;
  return size_m * Vec3((x_px - k.cx_px) / k.fx_px, (y_px - k.cy_px) / k.fy_px, 1.f);
}

TEST(Foe, FindsTheDirectionOfTravelAmongDepthsNoiseAndOutliers) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> x(120.f, 520.f), y(90.f, 390.f);
  for (unsigned run = 0; run < 100; ++run) {
    const float fx = x(random), fy = y(random);
    auto flow = flow_of_motion(step_towards(fx, fy, 0.3f), Vec3::Zero(), run, 0.1f);
    spoil(flow, 0.2f, run + 50u);
    const Foe foe = find_foe({}, flow);
    ASSERT_TRUE(foe.valid) << run;
    EXPECT_TRUE(foe.expanding);
    EXPECT_LT(std::hypot(foe.x_px - fx, foe.y_px - fy), 6.f) << run;  // 0.65 degrees
    EXPECT_LT(std::hypot(foe.x_px - fx, foe.y_px - fy), 5.f * foe.sigma_px) << run;
  }
}

TEST(Foe, MovingBackwardsIsAFocusOfContraction) {
  const Foe foe = find_foe({}, flow_of_motion(-step_towards(250.f, 200.f, 0.3f), Vec3::Zero(), 4, 0.05f));
  ASSERT_TRUE(foe.valid);
  EXPECT_FALSE(foe.expanding);
  EXPECT_NEAR(foe.x_px, 250.f, 5.f);
  EXPECT_NEAR(foe.y_px, 200.f, 5.f);
}

TEST(Foe, KnownTurnTakenOutLeavesTheFocus) {
  const Vec3 turn(0.01f, -0.02f, 0.015f);
  auto flow = flow_of_motion(step_towards(400.f, 180.f, 0.3f), turn, 9, 0.02f);
  const Mat3 R_first_second = Eigen::AngleAxisf(turn.norm(), turn.normalized()).toRotationMatrix();
  derotate(Lens{}, flow, R_first_second.transpose(), flow);
  const Foe foe = find_foe({}, flow);
  ASSERT_TRUE(foe.valid);
  EXPECT_NEAR(foe.x_px, 400.f, 3.f);
  EXPECT_NEAR(foe.y_px, 180.f, 3.f);
}

TEST(Foe, UnknownTurnIsSolvedFor) {
  for (unsigned run = 0; run < 20; ++run) {
    const Vec3 turn(0.004f, -0.006f, 0.005f);
    const Foe foe = find_foe_and_rotation({}, flow_of_motion(step_towards(380.f, 200.f, 0.4f), turn, run, 0.05f), {});
    ASSERT_TRUE(foe.valid) << run;
    EXPECT_LT(std::hypot(foe.x_px - 380.f, foe.y_px - 200.f), 15.f) << run;
    EXPECT_LT((foe.rotation_rad - turn).norm(), 1e-3f) << run;
  }
}

TEST(Foe, PrintedFormIsRightToOneCellForAFrontalSurface) {
  const auto flow = make_flow(similarity(0.f, 1.03f, 0.f, 0.f, 346.f, 186.f));
  const Foe foe = printed_foe({}, flow);
  ASSERT_TRUE(foe.valid);
  EXPECT_NEAR(foe.x_px, 346.f, 27.f);
  EXPECT_NEAR(foe.y_px, 186.f, 27.f);
}

TEST(Foe, StillOrSidewaysOrBadIsInvalid) {
  EXPECT_FALSE(find_foe({}, make_flow(similarity(0.f, 1.f, 0.f, 0.f), 0.03f)).valid);
  EXPECT_FALSE(find_foe({}, make_flow(similarity(0.f, 1.f, 5.f, 0.f), 0.03f)).valid);
  EXPECT_FALSE(find_foe({}, FlowField{}).valid);
  EXPECT_FALSE(printed_foe({}, FlowField{}).valid);
  EXPECT_FALSE(find_foe_and_rotation({}, FlowField{}, {}).valid);
  auto flow = make_flow(similarity(0.f, 1.03f, 0.f, 0.f));
  flow.at(2, 2).v_px = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(find_foe({}, flow).valid);
  EXPECT_FALSE(find_foe({.flow_sigma_px = 0.f}, flow).valid);
  EXPECT_FALSE(find_foe_and_rotation({}, flow, {.fx_px = 0.f}).valid);
  flow.columns = 40;
  EXPECT_FALSE(find_foe({}, flow).valid);
  EXPECT_FALSE(printed_foe({}, flow).valid);
}

TEST(Foe, DoesNotAllocate) {
  const auto flow = make_flow(similarity(0.f, 1.02f, 1.f, 0.f), 0.1f);
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    (void)find_foe({}, flow);
    (void)find_foe_and_rotation({}, flow, {});
    (void)printed_foe({}, flow);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
