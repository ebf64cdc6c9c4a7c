// Depth images with known truth for the tests of vision: a floor, walls, boxes, sensor noise and missing pixels,
// all seeded. Rays meet planes in closed form.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "types/camera.h"
#include "types/image_view.h"

namespace wasp::vision::test {

/// n . X = -height in camera axes.
struct Surface {
  Vec3 normal_cam{0.f, -1.f, 0.f};
  float height_m = 1.f;
};

/// A rectangle of pixels in which `surface` is nearer than what is behind it, or replaces it.
struct Patch {
  int u0, v0, u1, v1;
  Surface surface;
  bool replace = false;  ///< true: ignore what is behind (for surfaces farther away, e.g. below the floor)
};

struct Scene {
  Intrinsics k;
  Surface floor;
  bool has_floor = true;
  std::vector<Surface> walls;
  std::vector<Patch> patches;
  float noise_per_m = 0.0014f;  ///< sigma of inverse depth
  float missing_share = 0.1f;
  float clutter_share = 0.f;  ///< pixels replaced by something at random in front of the floor
  float max_depth_m = 8.f;
};

struct DepthImage {
  int width_px, height_px;
  std::vector<std::uint16_t> mm;
  [[nodiscard]] DepthView view() const { return {mm.data(), width_px, height_px, width_px}; }
};

inline float depth_of(const Surface& s, const Vec3& ray) {
  const float z = -s.height_m / s.normal_cam.dot(ray);
  return z > 0.f && std::isfinite(z) ? z : std::numeric_limits<float>::infinity();
}

inline DepthImage render(const Scene& scene, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0.f, scene.noise_per_m);
  std::uniform_real_distribution<float> uniform(0.f, 1.f);
  DepthImage image{scene.k.width_px, scene.k.height_px, {}};
  image.mm.resize(static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px));
  for (int v = 0; v < image.height_px; ++v)
    for (int u = 0; u < image.width_px; ++u) {
      const Vec3 ray((static_cast<float>(u) - scene.k.cx_px) / scene.k.fx_px,
                     (static_cast<float>(v) - scene.k.cy_px) / scene.k.fy_px, 1.f);
      float z = scene.has_floor ? depth_of(scene.floor, ray) : std::numeric_limits<float>::infinity();
      for (const Surface& wall : scene.walls) z = std::fmin(z, depth_of(wall, ray));
      for (const Patch& p : scene.patches)
        if (u >= p.u0 && u < p.u1 && v >= p.v0 && v < p.v1)
          z = p.replace ? depth_of(p.surface, ray) : std::fmin(z, depth_of(p.surface, ray));
      if (uniform(random) < scene.clutter_share) z = std::fmin(z, scene.max_depth_m) * (0.3f + 0.65f * uniform(random));
      const bool seen = z < scene.max_depth_m && uniform(random) >= scene.missing_share;
      const float measured = seen ? 1.f / std::fmax(1.f / z + noise(random), 0.05f) : 0.f;
      image.mm[static_cast<std::size_t>(v * image.width_px + u)] =
          static_cast<std::uint16_t>(std::lround(std::fmin(measured, 60.f) * 1000.f));
    }
  return image;
}

/// Up in the camera for a camera pitched down and rolled [rad].
inline Vec3 up_for(float pitch_down_rad, float roll_rad) {
  const Vec3 up(0.f, -std::cos(pitch_down_rad), -std::sin(pitch_down_rad));
  return Eigen::AngleAxisf(roll_rad, Vec3::UnitZ()) * up;
}

inline float angle_deg(const Vec3& a, const Vec3& b) {
  return std::acos(std::fmin(1.f, std::fmax(-1.f, a.dot(b)))) * 57.29578f;
}

}  // namespace wasp::vision::test
