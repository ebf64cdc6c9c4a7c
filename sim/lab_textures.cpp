#include "sim/lab_textures.h"

#include <algorithm>
#include <cmath>

#include "sim/random.h"

namespace wasp::sim {
namespace {

constexpr int kSmall = 256;

Texture paint(int size_px, const auto& shade) {
  return Texture(size_px, [&](int u, int v) { return shade((u + 0.5) / size_px, (v + 0.5) / size_px); });
}

/// Index of the plank that each floor column (x) belongs to.
std::vector<std::uint32_t> plank_of_column(double edges_per_m, std::uint32_t seed) {
  Random random(seed);
  std::vector<std::uint32_t> plank(kFloorTexels);
  double next_edge_m = random.exponential(1 / edges_per_m);
  std::uint32_t index = 0;
  for (int i = 0; i < kFloorTexels; ++i) {
    while (i * kFloorTexel_m > next_edge_m) next_edge_m += random.exponential(1 / edges_per_m), ++index;
    plank[static_cast<std::size_t>(i)] = index;
  }
  return plank;
}

/// Piece of a plank at y: planks are laid in lengths of 1.8 m with a shift of their own.
std::uint32_t piece_at(std::uint32_t plank, double y_m, std::uint32_t seed) {
  const double shift = 1.8 * static_cast<double>(uniform_of(mix(seed + 7, plank)));
  return plank * 64 + static_cast<std::uint32_t>((y_m + shift) / 1.8);
}

/// 1 where nothing shades, less within and just around a shadow's rectangle.
double light_at(double x_m, double y_m, const std::vector<FloorShadow>& shadows) {
  constexpr double kSoft_m = 0.22;
  double light = 1;
  for (const auto& s : shadows) {
    const double dx = std::max(0.0, std::abs(x_m - s.x_m) - s.half_x_m);
    const double dy = std::max(0.0, std::abs(y_m - s.y_m) - s.half_y_m);
    const double far = std::hypot(dx, dy) / kSoft_m;
    if (far < 1) light *= 1 - s.strength * (1 - far) * (1 - far);
  }
  return light;
}

double book_shade(double u, double v, std::uint32_t seed) {
  const auto book = static_cast<std::uint32_t>(u * 24);
  const double height = 0.72 + 0.26 * static_cast<double>(uniform_of(mix(seed, book)));
  if (1 - v > height) return 0.06;
  const double spine = std::abs(u * 24 - book - 0.5) > 0.44 ? 0.4 : 1.0;
  const double label = std::abs(v - 0.55) < 0.05 ? 0.35 : 0.0;
  return spine * (0.15 + 0.75 * static_cast<double>(uniform_of(mix(seed + 1, book)))) + label;
}

double text_shade(double u, double v, std::uint32_t seed) {
  const auto line = static_cast<std::uint32_t>(v * 24);
  const double indent = 0.05 + 0.1 * static_cast<double>(mix(seed, line) % 3);
  const double length = 0.3 + 0.6 * static_cast<double>(uniform_of(mix(seed + 1, line)));
  const bool ink = v * 24 - line > 0.35 && u > indent && u < length &&
                   mix(seed + 2, line * 97 + static_cast<std::uint32_t>(u * 60)) % 4 != 0;
  return ink ? 0.85 : 0.12;
}

double scribble_shade(double u, double v, std::uint32_t seed) {
  double shade = 0.97 + 0.03 * tile_noise(u, v, 8, seed);
  for (std::uint32_t i = 0; i < 7; ++i) {
    const double y = 0.15 + 0.11 * i, wave = 0.02 * std::sin(u * (40 + 13 * i)) + 0.015 * std::sin(u * 91 + i);
    const double end = 0.35 + 0.55 * static_cast<double>(uniform_of(mix(seed, i)));
    if (std::abs(v - y - wave) < 0.006 && u > 0.08 && u < end) shade = 0.2;
  }
  const bool frame = std::min({u, v, 1 - u, 1 - v}) < 0.02;
  return frame ? 0.45 : shade;
}

}  // namespace

Texture paint_floor(double edges_per_m, const std::vector<FloorShadow>& shadows, std::uint32_t seed) {
  const auto plank = plank_of_column(edges_per_m, seed);
  return Texture(kFloorTexels, [&](int ix, int iy) {
    const double x_m = ix * kFloorTexel_m, y_m = iy * kFloorTexel_m;
    const std::uint32_t column = plank[static_cast<std::size_t>(ix)];
    const std::uint32_t piece = piece_at(column, y_m, seed);
    const double tone = 0.42 + 0.40 * static_cast<double>(uniform_of(mix(seed + 3, piece)));
    const double grain = 0.16 * (tile_noise(x_m * 1.7, y_m * 0.11, 32, seed + 5 + column % 5) - 0.5);
    const bool joint = ix > 0 && plank[static_cast<std::size_t>(ix - 1)] != column;
    const bool butt = iy > 0 && piece_at(column, y_m - kFloorTexel_m, seed) != piece;
    return (joint || butt ? 0.22 : tone + grain) * light_at(x_m, y_m, shadows);
  });
}

Texture paint_detail() {
  return paint(kSmall, [](double u, double v) { return tile_noise(u, v, 32, 11); });
}

std::vector<Texture> paint_lab_textures(std::uint32_t s) {
  std::vector<Texture> t;
  t.push_back(paint_detail());
  t.push_back(paint(kSmall, [s](double u, double v) { return 0.78 + 0.16 * tile_noise(u, v, 16, s + 20); }));
  t.push_back(paint(kSmall, [s](double u, double v) { return 0.45 + 0.4 * tile_noise(u * 0.125, v, 64, s + 30); }));
  t.push_back(paint(kSmall, [s](double u, double v) {
    const bool tape = std::abs(u - 0.5) < 0.06;
    return (tape ? 0.72 : 0.5) + 0.14 * tile_noise(u, v, 16, s + 40) - (std::abs(v - 0.5) < 0.008 ? 0.25 : 0.0);
  }));
  t.push_back(paint(kSmall, [s](double u, double v) { return book_shade(u, v, s + 50); }));
  t.push_back(paint(kSmall, [s](double u, double v) { return text_shade(u, v, s + 60); }));
  t.push_back(paint(kSmall, [s](double u, double v) {
    return std::min(u, v) < 0.03 ? 0.5 : 0.85 + 0.1 * tile_noise(u, v, 32, s + 70);
  }));
  t.push_back(paint(kSmall * 2, [s](double u, double v) { return scribble_shade(u, v, s + 80); }));
  t.push_back(paint(kSmall, [s](double u, double v) { return 0.85 + 0.15 * tile_noise(u, v, 4, s + 90); }));
  return t;
}

}  // namespace wasp::sim
