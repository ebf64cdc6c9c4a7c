// What the generated worlds promise: distributions, ways left free, seeds.
#include "sim/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "sim/clearance.h"

namespace wasp::sim {
namespace {

/// Heights above ground of the roofs (faces that look up, above the ground), with their places.
std::vector<Vec3> roofs(const World& world) {
  std::vector<Vec3> found;
  for (std::size_t i = 0; i < world.quads.size(); ++i) {
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t v : world.quads[i]) middle += world.vertices_ned_m[v] / 4;
    if (std::abs(world.surfaces[i].normal.z()) > 0.9f && middle.z() < -0.1f) found.push_back(middle);
  }
  return found;
}

TEST(City, HeightsAreWithinTheirLimitsMirroredAndModulatedAlongTheWay) {
  const CityOptions options;
  double sum_high = 0, sum_low = 0;
  int high = 0, low = 0;
  for (std::uint32_t seed = 1; seed <= 12; ++seed) {
    const Scene scene = make_city(seed, options);
    const std::vector<Vec3> boxes = roofs(scene.world);
    ASSERT_GT(boxes.size(), 200u);
    std::map<float, std::pair<double, int>> rows;
    for (const Vec3& box : boxes) {
      EXPECT_GE(-box.z(), 0.3f - 1e-4f);
      EXPECT_LE(-box.z(), 4.f + 1e-4f);
      EXPECT_GT(box.x(), 6.f);
      EXPECT_LT(box.x(), 62.f);
      const auto twin = [&](const Vec3& other) { return (other - Vec3(box.x(), -box.y(), box.z())).norm() < 1e-4f; };
      EXPECT_TRUE(std::any_of(boxes.begin(), boxes.end(), twin)) << "mirrored about the x axis";
      auto& row = rows[box.x()];
      row.first += static_cast<double>(-box.z()), ++row.second;
    }
    double least = 1e9, most = 0;
    for (const auto& [x, row] : rows) {
      least = std::min(least, row.first / row.second), most = std::max(most, row.first / row.second);
    }
    sum_low += least, sum_high += most, ++low, ++high;
  }
  EXPECT_LT(sum_low / low, 0.9) << "mean of the exponential 0.6 m, where it is low";
  EXPECT_GT(sum_high / high, 1.5) << "2 m, where it is high, cut at 4 m";
}

TEST(City, TheStartIsFreeAndElsewhereForEachSeed) {
  std::set<int> decimetres;
  for (std::uint32_t seed = 1; seed <= 25; ++seed) {
    const Scene scene = make_city(seed, CityOptions{});
    EXPECT_GE(scene.start_ned_m.x(), 0.f);
    EXPECT_LE(scene.start_ned_m.x(), 1.5f);
    EXPECT_LE(std::abs(scene.start_ned_m.y()), 8.f);
    decimetres.insert(static_cast<int>(std::lround(scene.start_ned_m.y() * 10)));
    for (const Vec3& box : roofs(scene.world)) EXPECT_GT(box.x() - scene.start_ned_m.x(), 4.5f);
  }
  EXPECT_GT(decimetres.size(), 18u);
}

TEST(Edges, BordersAlongTheGroundAreAPoissonProcess) {
  for (const double lambda : {0.35, 2.0}) {
    double count = 0, squares = 0;
    constexpr int kSeeds = 200;
    for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
      const Scene scene = make_scene("edges", {.seed = seed, .ground_edges_per_m = lambda});
      int within = 0;
      for (std::size_t i = 1; i < scene.world.quads.size(); ++i) {
        const float border = scene.world.vertices_ned_m[scene.world.quads[i][0]].x();
        within += border > 0 && border < 100 ? 1 : 0;
        EXPECT_NE(scene.world.surfaces[i].brightness, scene.world.surfaces[i - 1].brightness) << "a border is seen";
      }
      count += within, squares += within * within;
    }
    const double mean = count / kSeeds, variance = squares / kSeeds - mean * mean, expected = 100 * lambda;
    EXPECT_NEAR(mean, expected, 4 * std::sqrt(expected / kSeeds));
    EXPECT_NEAR(variance, expected, 5 * expected * std::sqrt(2.0 / kSeeds));
  }
}

TEST(Wall, StandsSixToEightMetresAheadUpToFifteenDegreesAskew) {
  float nearest = 100, farthest = 0, most_askew = 0;
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    const World world = placed_at_start(make_scene("wall", seed));
    const Vec3 normal = world.surfaces[1].normal;
    const float distance = world.vertices_ned_m[world.quads[1][0]].dot(normal) / normal.x();
    nearest = std::min(nearest, distance), farthest = std::max(farthest, distance);
    most_askew = std::max(most_askew, std::abs(std::atan(normal.y() / normal.x())));
  }
  EXPECT_GE(nearest, 6.f);
  EXPECT_LT(nearest, 6.3f);
  EXPECT_LE(farthest, 8.f);
  EXPECT_GT(farthest, 7.7f);
  EXPECT_LE(most_askew, 0.2619f);
  EXPECT_GT(most_askew, 0.23f);
}

TEST(ArenaStep, IsDrawnFromTheSeedUpAndDown) {
  int up = 0;
  for (std::uint32_t seed = 1; seed <= 25; ++seed) {
    const ArenaStep step = arena_step_of(seed, 7);
    EXPECT_GE(step.from_m, 0.9f);
    EXPECT_LE(step.from_m, 1.5f);
    EXPECT_GE(std::abs(step.to_m - step.from_m), 0.3f - 1e-6f);
    EXPECT_LE(std::abs(step.to_m - step.from_m), 0.6f + 1e-6f);
    up += step.to_m > step.from_m ? 1 : 0;
    const Mover edge = make_arena(seed, step).world.movers.at(0);
    EXPECT_FLOAT_EQ(-edge.at(6.99).position_ned_m.z(), step.from_m);
    EXPECT_FLOAT_EQ(-edge.at(7.03).position_ned_m.z(), step.to_m);
  }
  EXPECT_GT(up, 4);
  EXPECT_LT(up, 21);
}

/// The widest gap [m] across the corridor at x, between what stands or walks there at a height of 1 m.
float widest_gap(const WorldScene& scene, float x, double t) {
  float best = 0, since = -1.3f;
  for (float y = -1.3f; y <= 1.3f; y += 0.02f) {
    const float clear = std::min(1.3f - std::abs(y), clearance_at(scene, {x, y, -1.f}, t).around_m);
    if (clear < 0.02f) since = y;
    best = std::max(best, y - since);
  }
  return best;
}

TEST(CorridorPeople, LeaveAWayOfOnePointTwoMetresAtAllTimes) {
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const WorldScene scene(make_scene("corridor-people", seed).world);  // in the corridor's own frame, not the start's
    ASSERT_EQ(scene.world().movers.size(), 2u);
    for (double t = 0; t < 60; t += 6.7)
      for (const Mover& walker : scene.world().movers)
        EXPECT_GT(widest_gap(scene, walker.at(t).position_ned_m.x(), t), 1.2f) << "seed " << seed << " at " << t;
    for (float x = 0; x < 28; x += 0.25f) EXPECT_GT(widest_gap(scene, x, 3), 1.2f) << "seed " << seed << " x " << x;
  }
}

TEST(CorridorPeople, WalkAtTheirSpeedsAndOneTowardsTheVehicle) {
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    const World world = make_scene("corridor-people", seed).world;
    const auto speed = [&](std::size_t i) {
      return (world.movers[i].at(0.2).position_ned_m.x() - world.movers[i].at(0).position_ned_m.x()) / 0.2f;
    };
    EXPECT_GT(speed(0), 0.39f) << "away from it, along its way";
    EXPECT_LT(speed(0), 0.81f);
    EXPECT_LT(speed(1), -0.39f) << "towards it";
    EXPECT_GT(speed(1), -0.81f);
    for (const Mover& walker : world.movers)
      for (double t = 0; t < 200; t += 0.5) {
        const float x = walker.at(t).position_ned_m.x();
        EXPECT_GE(x, 4.f - 1e-3f);
        EXPECT_LE(x, 27.f + 1e-3f);
        EXPECT_LT((walker.at(t + 0.05).position_ned_m - walker.at(t).position_ned_m).norm(), 0.05f) << "no jumps";
      }
  }
}

}  // namespace
}  // namespace wasp::sim
