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

  static constexpr float kSharpest_px = 1.5f;  ///< footprints beyond this go to a coarser level

  [[nodiscard]] int size_px() const { return size_px_; }
  /// Reflectance 0 ... 255 at (u, v), counted in repeats; `footprint_px` is the pixel's width in texels of level 0.
  /// sim/shading.cpp does the same for many rays at once.
  [[nodiscard]] float sample(float u, float v, float footprint_px) const {
    std::uint32_t level = 0;
    while (footprint_px > kSharpest_px && level + 1 < offsets_.size()) footprint_px *= 0.5f, ++level;
    const std::uint32_t n = static_cast<std::uint32_t>(size_px_) >> level, mask = n - 1;
    const float x = u * static_cast<float>(n) - 0.5f, y = v * static_cast<float>(n) - 0.5f;
    const float fx = floor_of(x), fy = floor_of(y);
    const float ax = x - fx, ay = y - fy;
    const auto x0 = static_cast<std::uint32_t>(static_cast<std::int32_t>(fx)) & mask;
    const auto y0 = static_cast<std::uint32_t>(static_cast<std::int32_t>(fy)) & mask, y1 = (y0 + 1) & mask;
    const std::uint8_t* first = texels_.data() + offsets_[level] + x0;
    const std::uint8_t *above = first + y0 * (n + 1), *below = first + y1 * (n + 1);
    const float top = lerp(above[0], above[1], ax), bottom = lerp(below[0], below[1], ax);
    return top + (bottom - top) * ay;
  }

  /// Levels one after the other, each n rows of n + 1 texels (the first again behind the last), and at least three
  /// bytes behind the last, so that any texel and its neighbour can be read as part of four bytes.
  [[nodiscard]] const std::uint8_t* texels() const { return texels_.data(); }
  /// Where each level begins in `texels`; n is size_px() >> level.
  [[nodiscard]] const std::vector<std::int32_t>& offsets() const { return offsets_; }

 private:
  static float floor_of(float x) {
    const auto i = static_cast<float>(static_cast<std::int32_t>(x));
    return i > x ? i - 1.f : i;
  }
  static float lerp(std::uint8_t a, std::uint8_t b, float t) {
    return static_cast<float>(a) + static_cast<float>(b - a) * t;
  }
  void append(const std::vector<std::uint8_t>& level, std::size_t n);

  int size_px_;
  std::vector<std::uint8_t> texels_;
  std::vector<std::int32_t> offsets_;
};

/// Tileable value noise, three octaves, 0 ... 1. `period` is the lattice count across the texture (power of two).
double tile_noise(double u, double v, int period, std::uint32_t seed);

}  // namespace wasp::sim
