// Worlds of a few glowing quads whose picture is known, for the tests of the camera's optics.
#pragma once

#include <cmath>
#include <memory>

#include "sim/renderer.h"

namespace wasp::sim {

inline World glowing_world() {
  World world;
  for (int i = 0; i < 2; ++i) world.textures.push_back(Texture(1, [](int, int) { return 0.5; }));
  return world;
}

/// A rectangle of pixel value `value` at right angles to north: centre (north, east, up), sides [m], turned by roll.
inline void add_board(World& world, const Vec3& centre, float width_m, float height_m, float value,
                      float roll_rad = 0) {
  const Vec3 right(0, std::cos(roll_rad), std::sin(roll_rad)), down(0, -std::sin(roll_rad), std::cos(roll_rad));
  const Vec3 middle(centre.x(), centre.y(), -centre.z());
  world.add_quad(middle - 0.5f * width_m * right - 0.5f * height_m * down, width_m * right, height_m * down,
                 {.texture = 0, .albedo = 0, .glow = value / 255});
}

/// A wall at `distance_m` north of the origin, dark (20) to the west and bright (220) to the east of the axis.
inline std::shared_ptr<const WorldScene> split_wall(float distance_m) {
  World world = glowing_world();
  add_board(world, {distance_m, -20, 0}, 40, 40, 20);
  add_board(world, {distance_m, 20, 0}, 40, 40, 220);
  return std::make_shared<const WorldScene>(std::move(world));
}

/// At the origin, looking north.
inline CameraPose northward() { return {Vec3::Zero(), R_body_cam_from_pitch_down(Radians{0.0})}; }

inline Intrinsics pinhole(int width_px, int height_px, float f_px) {
  return {.width_px = width_px,
          .height_px = height_px,
          .fx_px = f_px,
          .fy_px = f_px,
          .cx_px = 0.5f * static_cast<float>(width_px - 1),
          .cy_px = 0.5f * static_cast<float>(height_px - 1)};
}

/// Where the edge in row v of an image lies and how wide it is: mean and deviation of its slope along the row [px].
struct EdgeProfile {
  double at_px = 0, deviation_px = 0;
};
inline EdgeProfile edge_profile(const CastFrame& frame, int width_px, int v) {
  double sum = 0, first = 0, second = 0;
  const float* row = frame.luminance.data() + static_cast<std::ptrdiff_t>(v) * width_px;
  for (int u = 0; u + 1 < width_px; ++u) {
    const double step = static_cast<double>(row[u + 1]) - static_cast<double>(row[u]), x = u + 0.5;
    sum += step, first += x * step, second += x * x * step;
  }
  const double mean = first / sum;
  return {mean, std::sqrt(std::max(0.0, second / sum - mean * mean))};
}

}  // namespace wasp::sim
