#include "vision/kernels/free_path.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr int kSteps = 18;
constexpr float kStep_s = 0.15f;
constexpr int kFirst = 17, kThen = 7;                          // candidates
constexpr float kFirstStep_rad = 0.13f, kThenStep_rad = 0.2f;  // -60 ... 60 and -34 ... 34 degrees

/// Known points as arrays, so that the distance loop runs in vector registers.
struct Points {
  std::array<float, kSectors> x{}, y{}, vx{}, vy{};
  int count = 0;
};

Points points_of(const ObstacleMap& map) noexcept {
  Points out;
  for (const MapPoint& p : map.sector) {
    if (!p.known || p.x_m < -0.8f) continue;
    const auto k = static_cast<std::size_t>(out.count++);
    out.x[k] = p.x_m, out.y[k] = p.y_m, out.vx[k] = p.vx_mps, out.vy[k] = p.vy_mps;
  }
  return out;
}

float nearest_m(const Points& p, float x_m, float y_m, float time_s) noexcept {
  float least = 1e6f;
  for (std::size_t k = 0; k < static_cast<std::size_t>(p.count); ++k) {
    const float dx = p.x[k] + p.vx[k] * time_s - x_m, dy = p.y[k] + p.vy[k] * time_s - y_m;
    least = std::min(least, dx * dx + dy * dy);
  }
  return std::sqrt(least);
}

struct Pose {
  float x = 0, y = 0, heading = 0, travel = 0, rate = 0;
};

float steer(const PathParams& p, float target_rad, const Pose& now) noexcept {
  const float error = target_rad - now.heading - p.yaw_lag_s * now.rate;
  return std::clamp(p.heading_gain_1ps * error, -p.max_rate_radps, p.max_rate_radps);
}

void move(const PathParams& p, float speed_mps, float rate_wish, float dt_s, Pose& now) noexcept {
  const float yaw = 1.f - std::exp(-dt_s / std::max(0.02f, p.yaw_lag_s));
  const float drift = 1.f - std::exp(-dt_s / std::max(0.02f, p.drift_s));
  now.rate += yaw * (rate_wish - now.rate);
  now.heading += now.rate * dt_s;
  now.travel += drift * (now.heading - now.travel);
  now.x += speed_mps * std::cos(now.travel) * dt_s;
  now.y += speed_mps * std::sin(now.travel) * dt_s;
}

struct Outcome {
  float cost = 0, clearance_m = 1e6f;
};

/// Cost of coming near, heavier the nearer and the sooner.
Outcome fly(const PathParams& p, const Points& points, const Pose& begin, float speed_mps, float first_rad,
            float then_rad) noexcept {
  Pose now = begin;
  Outcome out;
  for (int step = 0; step < kSteps; ++step) {
    const float time_s = kStep_s * static_cast<float>(step + 1);
    move(p, speed_mps, steer(p, time_s <= p.first_s ? first_rad : then_rad, now), kStep_s, now);
    const float clearance = nearest_m(points, now.x, now.y, p.delay_s + time_s) - p.half_width_m;
    out.clearance_m = std::min(out.clearance_m, clearance);
    const float lack = std::max(0.f, p.comfort_m - clearance) / std::max(0.05f, p.comfort_m);
    const float hit = std::max(0.f, 0.05f - clearance);
    const float sooner = 1.5f - time_s / (kStep_s * static_cast<float>(kSteps));
    out.cost += sooner * (lack * lack + 30.f * hit);
  }
  return out;
}

float effort(float first_rad, float then_rad, float last_first_rad) noexcept {
  const float change = first_rad - last_first_rad;
  return 0.6f * first_rad * first_rad + 0.6f * then_rad * then_rad + 0.25f * change * change;
}

}  // namespace

PathChoice free_path(const PathParams& params, const ObstacleMap& map, const PathStart& start,
                     float last_first_rad) noexcept {
  PathChoice out;
  const Points points = points_of(map);
  Pose begin;
  begin.rate = start.yaw_rate_radps;
  begin.travel = start.travel_rad;
  move(params, start.speed_mps, start.yaw_rate_radps, std::max(0.f, params.delay_s), begin);
  const Outcome straight = fly(params, points, begin, start.speed_mps, 0.f, 0.f);
  out.clearance_m = out.straight_clearance_m = straight.clearance_m;
  if (points.count == 0 || straight.clearance_m >= params.margin_m) return out;
  float best = 1e9f;
  for (int i = 0; i < kFirst; ++i)
    for (int j = 0; j < kThen; ++j) {
      // Pairs in the order 0, +1, -1, +2 ...: of equals the smaller turn wins, and the one to the right.
      const float first_rad = kFirstStep_rad * static_cast<float>((i % 2 != 0 ? 1 : -1) * ((i + 1) / 2));
      const float then_rad = kThenStep_rad * static_cast<float>((j % 2 != 0 ? 1 : -1) * ((j + 1) / 2));
      const Outcome o = fly(params, points, begin, start.speed_mps, first_rad, then_rad);
      const float cost = o.cost + effort(first_rad, then_rad, last_first_rad);
      if (!(cost < best)) continue;
      best = cost;
      out.first_rad = first_rad, out.then_rad = then_rad, out.clearance_m = o.clearance_m;
    }
  out.in_way = true;
  out.stuck = out.clearance_m < 0.f;
  out.rate_radps = steer(params, out.first_rad, begin);
  return out;
}

}  // namespace wasp::vision
