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

}  // namespace

/// 200 m x 60 m of blocks on a 6 m grid. The mean height of the exponential goes up and down with a period of 60 m
/// along the way, 1.5 to 6.5 m; no box is taller than 15 m. The first 10 m are free.
Scene make_city(std::uint32_t seed) {
  Random random(seed);
  World world = empty_world(seed);
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
  return {std::move(world), Vec3::Zero(), 0, "city"};
}

Scene make_arena(std::uint32_t seed, float edge_height_m) {
  constexpr int kSides = 48;
  constexpr float kRadius = 4, kHeight = 4;
  World world = empty_world(seed);
  add_ground(world, 8, {kBlank, 1.f, 0.75f});
  const float edge = std::clamp(edge_height_m, 0.f, kHeight);
  for (int i = 0; i < kSides; ++i) {
    const auto corner = [&](int k) {
      const float a = kTwoPi * static_cast<float>(k) / kSides;
      return Vec3(kRadius * std::cos(a), kRadius * std::sin(a), 0);
    };
    const Vec3 from = corner(i), along = corner(i + 1) - from;
    world.add_quad(from + Vec3(0, 0, -kHeight), along, {0, 0, kHeight - edge}, {kBlank, 1.f, 0.25f});
    world.add_quad(from + Vec3(0, 0, -edge), along, {0, 0, edge}, {kBlank, 1.f, 0.85f});
  }
  return {std::move(world), Vec3::Zero(), 0, "arena"};
}

Scene make_wall(std::uint32_t seed) {
  World world = empty_world(seed);
  add_ground(world, 30, {kStreet, 3.f, 0.7f});
  world.add_quad({10, -12, -8}, {0, 24, 0}, {0, 0, 8}, {kNatural, 3.f, 1.f});
  return {std::move(world), Vec3::Zero(), 0, "wall"};
}

Scene make_ground(std::uint32_t seed) {
  World world = empty_world(seed);
  add_ground(world, 40, {kNatural, 2.5f, 1.f});
  return {std::move(world), Vec3::Zero(), 0, "ground"};
}

}  // namespace wasp::sim
