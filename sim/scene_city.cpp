// The city of thesis figs 7.16b, 7.20 and 7.21, at the scale its controller flies at: low boxes under the way, edges
// where roof meets wall, and little else to see.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/random.h"
#include "sim/scene_generators.h"

namespace wasp::sim {
namespace {

constexpr float kTwoPi = 2 * std::numbers::pi_v<float>;
constexpr float kBehind_m = -10, kSide_m = 60;

/// Four walls and a roof of another shade, without the underside.
void add_building(World& world, const Vec3& base, const Vec3& size, const Material& wall, const Material& roof) {
  const Vec3 x(size.x(), 0, 0), y(0, size.y(), 0), up(0, 0, -size.z()), corner = base - x / 2 - y / 2;
  world.add_quad(corner + up, y, x, roof);
  world.add_quad(corner + y + up, -y, -up, wall);
  world.add_quad(corner + x + up, y, -up, wall);
  world.add_quad(corner + up, x, -up, wall);
  world.add_quad(corner + x + y + up, -x, -up, wall);
}

/// Mean of the exponential at x: a sinusoid along the way.
double mean_height_m(const CityOptions& o, double x, double phase) {
  const double middle = (o.mean_low_m + o.mean_high_m) / 2, swing = (o.mean_high_m - o.mean_low_m) / 2;
  return middle + swing * std::sin(2 * std::numbers::pi * x / o.period_m + phase);
}

/// Plain walls, or few windows, each about a metre wide.
Material wall_of(Random& random, const CityOptions& o) {
  const auto albedo = static_cast<float>(random.uniform(0.55, 0.95));
  if (random.uniform() < o.windowed) return {kPlainFacade, 2.4f, albedo};
  return {kSoft, 1.5f, 1.7f * albedo};
}

}  // namespace

/// The boxes of one side are drawn and mirrored; the start is drawn last, so that it changes nothing else.
Scene make_city(std::uint32_t seed, const CityOptions& o) {
  Random random(mix(seed, 21));
  World world = empty_world(seed, {kSoft, kPlainFacade});
  world.sky = 215;
  world.add_quad({kBehind_m, -kSide_m, 0}, {static_cast<float>(o.length_m) + 40, 0, 0}, {0, 2 * kSide_m, 0},
                 {kSoft, 3.f, 0.9f});
  const double phase = random.uniform(0, 2 * std::numbers::pi);
  for (double x = o.free_before_m + o.pitch_m / 2; x < o.length_m - o.free_after_m; x += o.pitch_m)
    for (double y = o.pitch_m / 2; y < o.half_width_m; y += o.pitch_m) {
      const double height = std::clamp(random.exponential(mean_height_m(o, x, phase)), o.lowest_m, o.tallest_m);
      const auto side = [&] { return static_cast<float>(o.pitch_m * random.uniform(0.72, 0.92)); };
      const Vec3 size(side(), side(), static_cast<float>(height));
      const Material wall = wall_of(random, o), roof{kSoft, 1.5f, static_cast<float>(random.uniform(1.7, 2.2))};
      for (const float mirror : {1.f, -1.f})
        add_building(world, {static_cast<float>(x), mirror * static_cast<float>(y), 0}, size, wall, roof);
    }
  const Vec3 start(static_cast<float>(random.uniform(0, 1.5)), static_cast<float>(random.uniform(-8, 8)), 0);
  return {std::move(world), start, 0, "city"};
}

}  // namespace wasp::sim
