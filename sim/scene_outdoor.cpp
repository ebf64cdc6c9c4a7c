// City, arena, wall and ground.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/random.h"
#include "sim/scene_generators.h"

namespace wasp::sim {
namespace {

constexpr float kTwoPi = 2 * std::numbers::pi_v<float>;

constexpr float kSky = 215;

void add_ground(World& world, float half_m, const Material& material) {
  world.sky = kSky;
  world.add_quad({-half_m, -half_m, 0}, {2 * half_m, 0, 0}, {0, 2 * half_m, 0}, material);
}

constexpr double kEdgesFrom_m = -20, kEdgesTo_m = 200;

/// The edges of `make_edges` [m north of the start], from behind the start to the far end.
std::vector<float> poisson_edges(Random& random, double edges_per_m) {
  std::vector<float> edges;
  for (double x = kEdgesFrom_m; x < kEdgesTo_m; x += random.exponential(1 / edges_per_m))
    edges.push_back(static_cast<float>(x));
  return edges;
}

}  // namespace

/// 200 m x 60 m of blocks on a 6 m grid. The mean height of the exponential goes up and down with a period of 60 m
/// along the way, 1.5 to 6.5 m; no box is taller than 15 m. The first 10 m are free.
Scene make_city_tall(std::uint32_t seed) {
  Random random(seed);
  World world = empty_world(seed, {kStreet, kFacade});
  add_ground(world, 300, {kStreet, 4.f, 0.8f});
  const float phase = static_cast<float>(random.uniform()) * kTwoPi;
  for (float x = 10; x < 200; x += 6)
    for (float y = -30; y <= 30; y += 6) {
      const double mean = 4 + 2.5 * std::sin(static_cast<double>(kTwoPi * x / 60 + phase));
      const auto height = static_cast<float>(std::clamp(random.exponential(mean), 0.3, 15.0));
      const auto size = [&] { return static_cast<float>(random.uniform(2.5, 4.5)); };
      const Vec3 box(size(), size(), height);
      const auto shift = [&] { return static_cast<float>(random.uniform(-0.7, 0.7)); };
      world.add_box({x + shift(), y + shift(), 0}, box, 0,
                    {kFacade, static_cast<float>(random.uniform(5, 8)), static_cast<float>(random.uniform(0.7, 1.3))});
    }
  return {std::move(world), Vec3::Zero(), 0, "city-tall"};
}

namespace {

constexpr int kArenaSides = 48;
constexpr float kArenaRadius_m = 4, kArenaHeight_m = 4;

/// A drum's wall, its floor at z = 0 of the world's or mover's frame.
void add_drum(World& world, float radius_m, float from_m, float to_m, const Material& material) {
  const auto corner = [radius_m](int k) {
    const float a = kTwoPi * static_cast<float>(k) / kArenaSides;
    return Vec3(radius_m * std::cos(a), radius_m * std::sin(a), 0);
  };
  for (int i = 0; i < kArenaSides; ++i)
    world.add_quad(corner(i) + Vec3(0, 0, -to_m), corner(i + 1) - corner(i), {0, 0, to_m - from_m}, material);
}

}  // namespace

Scene make_arena(std::uint32_t seed, float edge_height_m) {
  World world = empty_world(seed, {});
  add_ground(world, 8, {kBlank, 1.f, 0.75f});
  const float edge = std::clamp(edge_height_m, 0.f, kArenaHeight_m);
  add_drum(world, kArenaRadius_m, edge, kArenaHeight_m, {kBlank, 1.f, 0.25f});
  add_drum(world, kArenaRadius_m, 0, edge, {kBlank, 1.f, 0.85f});
  return {std::move(world), Vec3::Zero(), 0, "arena"};
}

ArenaStep arena_step_of(std::uint32_t seed, double at_s) {
  Random random(mix(seed, 51));
  ArenaStep step;
  step.at_s = static_cast<float>(at_s);
  step.from_m = static_cast<float>(random.uniform(0.9, 1.5));
  const double change = random.uniform(0.3, 0.6);
  step.to_m = step.from_m + static_cast<float>(random.uniform() < 0.5 ? -change : change);
  return step;
}

/// The upper, dark part hangs just inside the light wall and moves as a whole; its own top stays out of sight.
Scene make_arena(std::uint32_t seed, const ArenaStep& step) {
  World world = empty_world(seed, {kSoft});
  add_ground(world, 8, {kSoft, 2.f, 1.4f});
  add_drum(world, kArenaRadius_m, 0, kArenaHeight_m, {kSoft, 2.f, 1.3f});
  const auto edge_at = [](float height_m) { return MoverPlace{Vec3(0, 0, -height_m), 0}; };
  std::vector<MoverKey> keys{{0, edge_at(step.from_m)}};
  if (step.at_s > 0) keys.push_back({step.at_s, edge_at(step.from_m)});
  keys.push_back({step.at_s + kArenaStepTakes_s, edge_at(step.to_m)});
  world.begin_mover("edge", std::move(keys), false);
  add_drum(world, kArenaRadius_m - 0.02f, 0, 2 * kArenaHeight_m, {kSoft, 2.f, 0.4f});
  world.end_mover();
  Random random(mix(seed, 51));
  const auto somewhere = [&] { return static_cast<float>(random.uniform(-0.8, 0.8)); };
  const Vec3 start(somewhere(), somewhere(), 0);
  return {std::move(world), start, static_cast<float>(random.uniform(0, 1)) * kTwoPi, "arena-step"};
}

/// The wall's place and angle come from the seed as its texture does.
Scene make_wall(std::uint32_t seed) {
  Random random(mix(seed, 31));
  World world = empty_world(seed, {kStreet, kNatural});
  add_ground(world, 30, {kStreet, 3.f, 0.7f});
  const auto distance_m = static_cast<float>(random.uniform(6, 8));
  const auto askew = static_cast<float>(random.uniform(-15, 15)) * kTwoPi / 360;
  const Vec3 along(-std::sin(askew), std::cos(askew), 0);
  world.add_quad(Vec3(distance_m, 0, -8) - 12 * along, 24 * along, {0, 0, 8}, {kNatural, 3.f, 1.f});
  return {std::move(world), Vec3::Zero(), 0, "wall"};
}

Scene make_edges(std::uint32_t seed, double edges_per_m) {
  constexpr float kHalfWidth = 300;
  Random random(mix(seed, 41));
  World world = empty_world(seed, {});
  world.make_smooth();
  world.sky = kSky;
  std::vector<float> edges = poisson_edges(random, edges_per_m);
  edges.push_back(static_cast<float>(kEdgesTo_m));
  for (std::size_t i = 0; i + 1 < edges.size(); ++i)
    world.add_quad({edges[i], -kHalfWidth, 0}, {edges[i + 1] - edges[i], 0, 0}, {0, 2 * kHalfWidth, 0},
                   {kBlank, 1.f, i % 2 == 0 ? 0.55f : 1.15f});
  return {std::move(world), Vec3::Zero(), 0, "edges"};
}

Scene make_ground(std::uint32_t seed) {
  World world = empty_world(seed, {kNatural});
  add_ground(world, 40, {kNatural, 2.5f, 1.f});
  return {std::move(world), Vec3::Zero(), 0, "ground"};
}

}  // namespace wasp::sim
