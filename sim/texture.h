// A repeating grey texture with its mipmaps: each level halves the last by the mean of four, a sample is bilinear in
// the level whose texel is about as wide as the pixel's footprint.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace wasp::sim {

class Texture {
 public:
  /// Square, `size_px` a power of two. `shade(u, v)` gives 0 ... 1 at the centre of texel (u, v).
  Texture(int size_px, const std::function<double(int u, int v)>& shade);

  [[nodiscard]] int size_px() const { return size_px_; }
  /// Reflectance 0 ... 255 at (u, v), counted in repeats; `footprint_px` is the pixel's width in texels of level 0.
  [[nodiscard]] float sample(float u, float v, float footprint_px) const {
    std::uint32_t level = 0;
    while (footprint_px > 1.5f && level + 1 < levels_.size()) footprint_px *= 0.5f, ++level;
    const Level& l = levels_[level];
    const float x = u * l.size - 0.5f, y = v * l.size - 0.5f;
    const float fx = floor_of(x), fy = floor_of(y);
    const float ax = x - fx, ay = y - fy;
    const auto x0 = static_cast<std::uint32_t>(static_cast<std::int32_t>(fx)) & l.mask;
    const auto y0 = (static_cast<std::uint32_t>(static_cast<std::int32_t>(fy)) & l.mask) << l.shift;
    const auto x1 = (x0 + 1) & l.mask, y1 = (y0 + l.mask + 1) & l.wrap;
    const std::uint8_t* t = l.texels.data();
    const float top = lerp(t[y0 + x0], t[y0 + x1], ax), bottom = lerp(t[y1 + x0], t[y1 + x1], ax);
    return top + (bottom - top) * ay;
  }

 private:
  struct Level {
    float size = 0;
    std::uint32_t mask = 0, shift = 0, wrap = 0;  ///< size - 1, log2 size, size * size - 1
    std::vector<std::uint8_t> texels;
  };
  static float floor_of(float x) {
    const auto i = static_cast<float>(static_cast<std::int32_t>(x));
    return i > x ? i - 1.f : i;
  }
  static float lerp(std::uint8_t a, std::uint8_t b, float t) {
    return static_cast<float>(a) + static_cast<float>(b - a) * t;
  }
  static Level make_level(int size_px);
  static Level halve(const Level& from);

  int size_px_;
  std::vector<Level> levels_;
};

/// Tileable value noise, three octaves, 0 ... 1. `period` is the lattice count across the texture (power of two).
double tile_noise(double u, double v, int period, std::uint32_t seed);

}  // namespace wasp::sim
