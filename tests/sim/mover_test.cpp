#include "sim/mover.h"

#include <gtest/gtest.h>

#include <numbers>

#include "sim/scene.h"

namespace wasp::sim {
namespace {

Mover path(std::vector<MoverKey> keys, bool looped) { return {"m", 0, 0, std::move(keys), looped}; }

MoverKey key(float at_s, float north_m, float yaw_rad = 0) { return {at_s, {Vec3(north_m, 0, 0), yaw_rad}}; }

TEST(Mover, GoesStraightBetweenKeysAndStaysAtTheLast) {
  const Mover mover = path({key(0, 1), key(2, 5, 1), key(2.5f, 5, 1)}, false);
  EXPECT_FLOAT_EQ(mover.at(-3).position_ned_m.x(), 1);
  EXPECT_FLOAT_EQ(mover.at(0).position_ned_m.x(), 1);
  EXPECT_FLOAT_EQ(mover.at(0.5).position_ned_m.x(), 2);
  EXPECT_FLOAT_EQ(mover.at(0.5).yaw_rad, 0.25f);
  EXPECT_FLOAT_EQ(mover.at(2).position_ned_m.x(), 5);
  EXPECT_FLOAT_EQ(mover.at(1e6).position_ned_m.x(), 5);
}

TEST(Mover, ALoopBeginsAgain) {
  const Mover mover = path({key(0, 0), key(1, 4), key(4, 0)}, true);
  for (const double t : {0.25, 0.9, 3.0}) {
    EXPECT_NEAR(mover.at(t).position_ned_m.x(), mover.at(t + 400).position_ned_m.x(), 1e-3f) << t;
  }
  EXPECT_FLOAT_EQ(path({key(0, 7)}, true).at(12).position_ned_m.x(), 7) << "a single key is a place";
}

World world_with_a_moving_box() {
  World world;
  world.textures.push_back(Texture(2, [](int u, int v) { return (u + v) % 2 * 0.5; }));
  world.textures.push_back(world.textures[0]);
  world.add_quad({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, {0, 1.f, 1.f});
  world.begin_mover("box", {key(0, 1), key(2, 3, std::numbers::pi_v<float> / 2)}, false);
  world.add_box({0, 0, 0}, {1, 0.5f, 2}, 0, {0, 0.7f, 1.f});
  world.end_mover();
  return world;
}

TEST(World, AtATimePutsPartsInPlaceAndTheirTexturesWithThem) {
  const World world = world_with_a_moving_box(), still = world.at(2);
  EXPECT_EQ(world.still_quads(), 1u);
  EXPECT_TRUE(still.movers.empty());
  Vec3 low = Vec3::Constant(1e9f), high = -low;
  for (std::size_t quad = 1; quad < still.quads.size(); ++quad)
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const Vec3& p = still.vertices_ned_m[still.quads[quad][corner]];
      const Vec3& own = world.vertices_ned_m[world.quads[quad][corner]];
      low = low.cwiseMin(p), high = high.cwiseMax(p);
      const Surface &after = still.surfaces[quad], &before = world.surfaces[quad];
      EXPECT_NEAR(after.u_axis.dot(p) + after.u0, before.u_axis.dot(own) + before.u0, 1e-5f);
      EXPECT_NEAR(after.v_axis.dot(p) + after.v0, before.v_axis.dot(own) + before.v0, 1e-5f);
    }
  EXPECT_LT((low - Vec3(2.75f, -0.5f, -2)).norm(), 1e-5f) << "turned by a quarter: 0.5 m along, 1 m across";
  EXPECT_LT((high - Vec3(3.25f, 0.5f, 0)).norm(), 1e-5f);
}

TEST(World, ThePathIsMovedToTheStartAsTheRestIs) {
  Scene scene{world_with_a_moving_box(), Vec3(1, 2, 0), 0.4f, "moving"};
  const World placed = placed_at_start(scene).at(1.5);
  scene.world = scene.world.at(1.5);
  const World expected = placed_at_start(scene);
  ASSERT_EQ(placed.vertices_ned_m.size(), expected.vertices_ned_m.size());
  for (std::size_t v = 0; v < placed.vertices_ned_m.size(); ++v)
    EXPECT_LT((placed.vertices_ned_m[v] - expected.vertices_ned_m[v]).norm(), 1e-5f);
}

}  // namespace
}  // namespace wasp::sim
