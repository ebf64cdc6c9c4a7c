#include "sim/texture.h"

#include <algorithm>
#include <cmath>

#include "sim/random.h"

namespace wasp::sim {
namespace {

double lattice(int x, int y, int period, std::uint32_t seed) {
  const auto wrap = static_cast<std::uint32_t>(period - 1);
  const auto cell = (static_cast<std::uint32_t>(y) & wrap) * static_cast<std::uint32_t>(period) +
                    (static_cast<std::uint32_t>(x) & wrap);
  return static_cast<double>(uniform_of(mix(seed, cell)));
}

double smooth(double t) { return t * t * (3 - 2 * t); }

double octave(double u, double v, int period, std::uint32_t seed) {
  const double x = u * period, y = v * period;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const double a = smooth(x - x0), b = smooth(y - y0);
  const double top = std::lerp(lattice(x0, y0, period, seed), lattice(x0 + 1, y0, period, seed), a);
  const double bottom = std::lerp(lattice(x0, y0 + 1, period, seed), lattice(x0 + 1, y0 + 1, period, seed), a);
  return std::lerp(top, bottom, b);
}

std::vector<std::uint8_t> halved(const std::vector<std::uint8_t>& from, std::size_t n) {
  std::vector<std::uint8_t> to(n * n / 4);
  for (std::size_t y = 0; y < n; y += 2)
    for (std::size_t x = 0; x < n; x += 2) {
      const std::uint8_t* t = from.data() + y * n + x;
      to[y / 2 * (n / 2) + x / 2] = static_cast<std::uint8_t>((t[0] + t[1] + t[n] + t[n + 1] + 2) / 4);
    }
  return to;
}

}  // namespace

double tile_noise(double u, double v, int period, std::uint32_t seed) {
  return 0.5 * octave(u, v, period, seed) + 0.3 * octave(u, v, 2 * period, seed + 1) +
         0.2 * octave(u, v, 4 * period, seed + 2);
}

void Texture::append(const std::vector<std::uint8_t>& level, std::size_t n) {
  constexpr std::size_t kBehind = 3;
  offsets_.push_back(static_cast<std::int32_t>(texels_.empty() ? 0 : texels_.size() - kBehind));
  if (!texels_.empty()) texels_.resize(texels_.size() - kBehind);
  for (std::size_t y = 0; y < n; ++y) {
    const auto row = level.begin() + static_cast<std::ptrdiff_t>(y * n);
    texels_.insert(texels_.end(), row, row + static_cast<std::ptrdiff_t>(n));
    texels_.push_back(*row);
  }
  texels_.resize(texels_.size() + kBehind);
}

Texture::Texture(int size_px, const std::function<double(int, int)>& shade) : size_px_(size_px) {
  auto n = static_cast<std::size_t>(size_px);
  std::vector<std::uint8_t> level(n * n);
  for (int v = 0; v < size_px; ++v)
    for (int u = 0; u < size_px; ++u)
      level[static_cast<std::size_t>(v) * n + static_cast<std::size_t>(u)] =
          static_cast<std::uint8_t>(std::lround(std::clamp(shade(u, v), 0.0, 1.0) * 255));
  append(level, n);
  for (; n > 1; n /= 2) {
    level = halved(level, n);
    append(level, n / 2);
  }
}

}  // namespace wasp::sim
