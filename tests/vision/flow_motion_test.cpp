#include "vision/kernels/flow_motion.h"

#include <gtest/gtest.h>

#include "rt/contract.h"
#include "tests/support/malloc_guard.h"
#include "tests/vision/flow_scene.h"

namespace wasp::vision {
namespace {

using namespace test;

FlowScene room(float noise_px = 0.f, float outliers = 0.f) {
  FlowScene scene{pinhole(320, 240, 1.3f, 0.3), {ground(), wall_ahead(4.f), {Vec3(0, 1, 0), 1.5f}}};
  scene.noise_px = noise_px, scene.outliers = outliers;
  return scene;
}

FlowMessage moved(const FlowScene& scene, const Vec3& by_ned_m, unsigned seed = 1) {
  const Euler turned{0.02f, -0.01f, 0.03f};
  return scene.message({Vec3(0, 0, -1), {}}, {Vec3(0, 0, -1) + by_ned_m, turned}, kSecond, seed);
}

TEST(FlowMotion, ExactWithoutNoiseInEveryDirection) {
  const FlowScene scene = room();
  for (const Vec3& by :
       {Vec3(0.1f, 0, 0), Vec3(0, 0.1f, 0), Vec3(0, 0, 0.1f), Vec3(-0.05f, 0.03f, -0.02f), Vec3(0, 0, 0)}) {
    const FlowMessage m = moved(scene, by);
    const FlowMotion motion = flow_motion({}, scene.camera.lens(), m.still, m.depth_m);
    ASSERT_TRUE(motion.valid);
    EXPECT_LT((scene.camera.R_body_cam * motion.moved_m - by).norm(), 2e-4f);
    EXPECT_EQ(motion.inliers, motion.cells);
  }
}

TEST(FlowMotion, AThirdOfTheCellsMayBeWrongAndTheCovarianceHolds) {
  const FlowScene scene = room(0.1f, 0.33f);
  const Vec3 by(0.04f, 0.01f, 0.f);
  double squares = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    FlowMessage m = moved(scene, by, seed);
    for (std::size_t i = seed % 7; i < 108; i += 7) m.depth_m[i] *= 2.f;  // and some depths
    const FlowMotion motion = flow_motion({.min_inlier_share = 0.4f}, scene.camera.lens(), m.still, m.depth_m);
    ASSERT_TRUE(motion.valid) << seed;
    const Vec3 error = motion.moved_m - scene.camera.R_body_cam.transpose() * by;
    EXPECT_LT(error.norm(), 0.006f) << seed;
    squares += static_cast<double>(error.dot(motion.covariance_m2.ldlt().solve(error))) / 3;
  }
  EXPECT_GT(squares / 100, 0.1);
  EXPECT_LT(squares / 100, 3.0);
}

TEST(FlowMotion, BadInput) {
  const FlowScene scene = room();
  const FlowMessage m = moved(scene, Vec3(0.1f, 0, 0));
  const Lens lens = scene.camera.lens();
  EXPECT_TRUE(flow_motion({}, lens, m.still, m.depth_m).valid);
  EXPECT_FALSE(flow_motion({}, lens, m.still, {}).valid);
  EXPECT_FALSE(flow_motion({}, lens, FlowField{}, m.depth_m).valid);
  EXPECT_FALSE(flow_motion({.flow_sigma_px = 0.f}, lens, m.still, m.depth_m).valid);
  EXPECT_FALSE(flow_motion({.inlier_sigmas = std::nanf("")}, lens, m.still, m.depth_m).valid);
  EXPECT_FALSE(flow_motion({.min_depth_m = 0.f}, lens, m.still, m.depth_m).valid);
  FlowField shape = m.still;
  shape.rows = -3;
  EXPECT_FALSE(flow_motion({}, lens, shape, m.depth_m).valid);
  FlowMessage mess = moved(room(0.f, 1.f), Vec3(0.1f, 0, 0));
  EXPECT_FALSE(flow_motion({}, lens, mess.still, mess.depth_m).valid);
}

TEST(FlowMotion, DoesNotAllocate) {
  const FlowScene scene = room(0.1f, 0.1f);
  const FlowMessage m = moved(scene, Vec3(0.1f, 0, 0));
  const Lens lens = scene.camera.lens();
  const wasp::test::MallocCount count;
  {
    const rt::RealtimeSection section;
    EXPECT_TRUE(flow_motion({}, lens, m.still, m.depth_m).valid);
  }
  EXPECT_EQ(count.violations(), 0u);
}

}  // namespace
}  // namespace wasp::vision
