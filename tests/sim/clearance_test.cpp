#include "sim/clearance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/renderer.h"
#include "sim/scene.h"

namespace wasp::sim {
namespace {

World plain() {
  World world;
  world.textures.push_back(Texture(1, [](int, int) { return 0.5; }));
  world.textures.push_back(world.textures[0]);
  return world;
}

/// A floor, and a post of 4 cm x 4 cm 1 m to the north, 2 m tall.
World floor_and_post() {
  World world = plain();
  world.add_quad({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, {});
  world.add_box({1, 0, 0}, {0.04f, 0.04f, 2}, 0, {});
  return world;
}

TEST(Clearance, IsTheDistanceToTheNearestSurface) {
  const WorldScene scene(floor_and_post());
  const Clearance c = clearance_at(scene, {0, 0, -0.8f}, 0);
  EXPECT_NEAR(c.below_m, 0.8f, 1e-5f);
  EXPECT_NEAR(c.around_m, 0.98f, 1e-5f) << "a thin post is not missed";
  const Clearance corner = clearance_at(scene, {0.98f - 0.3f, 0.02f + 0.4f, -1}, 0);
  EXPECT_NEAR(corner.around_m, 0.5f, 1e-4f) << "to an edge";
  EXPECT_FALSE(corner.collides());
  EXPECT_TRUE(clearance_at(scene, {0.7f, 0, -1}, 0).collides());
}

TEST(Clearance, StandingAndLandingAreNoCollision) {
  const WorldScene scene(floor_and_post());
  const Clearance standing = clearance_at(scene, {0, 0, -0.2f}, 0);
  EXPECT_NEAR(standing.below_m, 0.2f, 1e-5f);
  EXPECT_FALSE(standing.collides());
  EXPECT_TRUE(standing.collides_in_flight());
}

TEST(Clearance, BeyondItsRangeAndOutOfTheWorldItIsTheRange) {
  const WorldScene scene(floor_and_post());
  const Clearance high = clearance_at(scene, {-4, 0, -40}, 0);
  EXPECT_EQ(high.below_m, kClearanceRange_m);
  EXPECT_EQ(high.around_m, kClearanceRange_m);
  EXPECT_TRUE(clearance_at(scene, {NAN, 0, 0}, 0).collides()) << "nowhere is never clear";
}

TEST(Clearance, FollowsWhatMoves) {
  World world = plain();
  world.add_quad({-9, -9, 0}, {18, 0, 0}, {0, 18, 0}, {});
  world.begin_mover("box", {{0, {Vec3(3, 0, 0), 0}}, {4, {Vec3(1, 0, 0), 0}}}, false);
  world.add_box({0, 0, 0}, {0.4f, 0.4f, 2}, 0, {});
  world.end_mover();
  const WorldScene scene(std::move(world));
  for (const double t : {0.0, 1.0, 2.5, 4.0, 9.0, 0.5})
    EXPECT_NEAR(clearance_at(scene, {0, 0, -1.5f}, t).around_m, std::max(0.8, 2.8 - 0.5 * t), 1e-5) << t;
}

TEST(Clearance, AgreesWithWhatTheRendererSees) {
  const WorldScene scene(placed_at_start(make_scene("laboratory", 1)));
  const Renderer renderer(
      placed_at_start(make_scene("laboratory", 1)),
      {.width_px = 160, .height_px = 160, .fx_px = 80, .fy_px = 80, .cx_px = 79.5f, .cy_px = 79.5f});
  const Vec3 centre(3.5f, -1.5f, -1.0f);
  float nearest_m = kClearanceRange_m;  // over six views that cover the sphere
  std::vector<float> luminance(160 * 4), depth(160 * 4);
  for (const Vec3& axis :
       {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)}) {
    const Mat3 R = Quat::FromTwoVectors(Vec3::UnitZ(), axis).toRotationMatrix();
    for (int row = 0; row < 160; row += 4) {
      renderer.render_band({centre, R}, row, luminance.data(), depth.data());
      for (int i = 0; i < 640; ++i) {
        const float x = (static_cast<float>(i % 160) - 79.5f) / 80;
        const float y = (static_cast<float>(row + i / 160) - 79.5f) / 80;
        if (const float z = depth[static_cast<std::size_t>(i)]; z > 0)
          nearest_m = std::min(nearest_m, z * std::sqrt(1 + x * x + y * y));
      }
    }
  }
  const Clearance c = clearance_at(scene, centre, 0);
  EXPECT_NEAR(std::min(c.below_m, c.around_m), nearest_m, 0.02f);
  EXPECT_LE(std::min(c.below_m, c.around_m), nearest_m + 1e-4f);
}

}  // namespace
}  // namespace wasp::sim
