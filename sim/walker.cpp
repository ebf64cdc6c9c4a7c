#include "sim/walker.h"

#include <numbers>

#include "sim/scene_generators.h"

namespace wasp::sim {
namespace {

constexpr float kTurn_s = 1;

std::vector<MoverKey> keys_of(const Beat& b) {
  constexpr float kPi = std::numbers::pi_v<float>;
  std::vector<MoverKey> keys;
  float now_s = 0, x = b.from_x_m + b.start_share * (b.to_x_m - b.from_x_m);
  const auto stand = [&](float yaw) { keys.push_back({now_s, {Vec3(x, b.y_m, 0), yaw}}); };
  const auto walk = [&](float to_x, float yaw) {
    now_s += std::fabs(to_x - x) / b.speed_mps;
    x = to_x;
    stand(yaw);
  };
  const auto turn = [&](float yaw) {
    now_s += kTurn_s / 2;
    stand(b.turn_yaw_rad);
    now_s += kTurn_s / 2;
    stand(yaw);
  };
  const float start_x = x, first = b.towards_to ? 0 : kPi * (b.turn_yaw_rad > 0 ? 1.f : -1.f);
  const float back = b.towards_to ? kPi * (b.turn_yaw_rad > 0 ? 1.f : -1.f) : 0;
  stand(first);
  walk(b.towards_to ? b.to_x_m : b.from_x_m, first), turn(back);
  walk(b.towards_to ? b.from_x_m : b.to_x_m, back), turn(first);
  walk(start_x, first);
  return keys;
}

}  // namespace

void add_walker(World& world, const std::string& name, const Beat& beat, Random& random) {
  const auto between = [&](double low, double high) { return static_cast<float>(random.uniform(low, high)); };
  const float tall = between(1.6, 1.85), hip = 0.47f * tall, shoulder = 0.83f * tall;
  const Material trousers{kSoft, 0.7f, between(0.3, 0.7)}, shirt{kCloth, 0.7f, between(0.8, 1.5)};
  const Material skin{kBlank, 1.f, between(0.35, 0.7)}, hair{kBlank, 1.f, between(0.1, 0.5)};
  world.begin_mover(name, keys_of(beat), true);
  for (const float side : {-0.11f, 0.11f}) {
    world.add_box({0, side, -0.07f}, {0.16f, 0.16f, hip - 0.07f}, 0, trousers);
    world.add_box({0.05f, side, 0}, {0.28f, 0.11f, 0.07f}, 0, {kBlank, 1.f, 0.15f});
  }
  world.add_box({0, 0, -hip}, {0.22f, 0.31f, shoulder - hip}, 0, shirt);
  for (const float side : {-0.19f, 0.19f})
    world.add_box({0.02f, side, -hip}, {0.1f, 0.07f, shoulder - hip - 0.03f}, 0, shirt);
  world.add_box({0, 0, -shoulder}, {0.11f, 0.12f, 0.06f}, 0, skin);
  world.add_box({0, 0, -shoulder - 0.06f}, {0.19f, 0.16f, 0.7f * (tall - shoulder - 0.06f)}, 0, skin);
  world.add_box({-0.01f, 0, -shoulder - 0.06f - 0.7f * (tall - shoulder - 0.06f)},
                {0.2f, 0.17f, 0.3f * (tall - shoulder - 0.06f)}, 0, hair);
  world.end_mover();
}

}  // namespace wasp::sim
