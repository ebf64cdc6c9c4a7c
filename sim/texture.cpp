#include "sim/texture.h"

#include <algorithm>
#include <bit>
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

}  // namespace

double tile_noise(double u, double v, int period, std::uint32_t seed) {
  return 0.5 * octave(u, v, period, seed) + 0.3 * octave(u, v, 2 * period, seed + 1) +
         0.2 * octave(u, v, 4 * period, seed + 2);
}

Texture::Level Texture::make_level(int size_px) {
  const auto n = static_cast<std::uint32_t>(size_px);
  Level level;
  level.size = static_cast<float>(size_px);
  level.mask = n - 1;
  level.shift = static_cast<std::uint32_t>(std::countr_zero(n));
  level.wrap = n * n - 1;
  level.texels.resize(n * n);
  return level;
}

Texture::Level Texture::halve(const Level& from) {
  const auto n = static_cast<std::size_t>(from.size);
  Level to = make_level(static_cast<int>(n / 2));
  for (std::size_t y = 0; y < n; y += 2)
    for (std::size_t x = 0; x < n; x += 2) {
      const std::uint8_t* t = from.texels.data() + y * n + x;
      to.texels[y / 2 * (n / 2) + x / 2] = static_cast<std::uint8_t>((t[0] + t[1] + t[n] + t[n + 1] + 2) / 4);
    }
  return to;
}

Texture::Texture(int size_px, const std::function<double(int, int)>& shade) : size_px_(size_px) {
  Level base = make_level(size_px);
  for (int v = 0; v < size_px; ++v)
    for (int u = 0; u < size_px; ++u)
      base.texels[static_cast<std::size_t>(v) * static_cast<std::size_t>(size_px) + static_cast<std::size_t>(u)] =
          static_cast<std::uint8_t>(std::lround(std::clamp(shade(u, v), 0.0, 1.0) * 255));
  levels_.push_back(std::move(base));
  while (levels_.back().size > 1) levels_.push_back(halve(levels_.back()));
}

}  // namespace wasp::sim
