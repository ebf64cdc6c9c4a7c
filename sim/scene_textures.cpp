// Textures of the generated scenes. "Natural" has the amplitude spectrum of natural images, about 1 / f: each octave of
// noise has the weight of its wavelength.
#include <algorithm>
#include <cmath>

#include "sim/lab_textures.h"
#include "sim/random.h"
#include "sim/scene_generators.h"

namespace wasp::sim {
namespace {

constexpr int kSide = 256, kNaturalSide = 512;

Texture paint(int size_px, const auto& shade) {
  return Texture(size_px, [&](int u, int v) { return shade((u + 0.5) / size_px, (v + 0.5) / size_px); });
}

double natural(double u, double v, std::uint32_t seed) {
  double sum = 0;
  for (int octave = 0; octave < 5; ++octave)
    sum += (tile_noise(u, v, 4 << octave, seed + static_cast<std::uint32_t>(10 * octave)) - 0.5) / (1 << octave);
  return std::clamp(0.5 + 1.1 * sum, 0.02, 0.98);
}

/// Four by four windows; some are lit.
double facade(double u, double v, std::uint32_t seed) {
  const double x = u * 4 - std::floor(u * 4), y = v * 4 - std::floor(v * 4);
  const auto window = static_cast<std::uint32_t>(u * 4) + 4 * static_cast<std::uint32_t>(v * 4);
  const bool glass = x > 0.22 && x < 0.78 && y > 0.25 && y < 0.85;
  if (glass) return 0.10 + 0.45 * static_cast<double>(uniform_of(mix(seed, window)));
  return 0.62 + 0.2 * (tile_noise(u, v, 32, seed + 3) - 0.5);
}

/// Two windows in a plain wall.
double few_windows(double u, double v, std::uint32_t seed) {
  const bool glass = v > 0.3 && v < 0.62 && ((u > 0.12 && u < 0.36) || (u > 0.62 && u < 0.86));
  return glass ? 0.3 : 0.8 + 0.12 * (tile_noise(u, v, 16, seed) - 0.5);
}

/// Check with a weave in it: clothes.
double cloth(double u, double v, std::uint32_t seed) {
  const double check = (std::fmod(u * 8, 1.0) < 0.5 ? 0.12 : 0.0) + (std::fmod(v * 8, 1.0) < 0.4 ? 0.14 : 0.0);
  return 0.4 + check + 0.35 * (natural(u, v, seed) - 0.5);
}

/// One sheet in four has a dark heading.
double notices(double u, double v, std::uint32_t seed) {
  const auto sheet = static_cast<std::uint32_t>(u * 4) + 4 * static_cast<std::uint32_t>(v * 4);
  const double x = u * 4 - std::floor(u * 4), y = v * 4 - std::floor(v * 4);
  const double tone = 0.55 + 0.45 * static_cast<double>(uniform_of(mix(seed, sheet)));
  if (std::min({x, y, 1 - x, 1 - y}) < 0.09) return 0.42;
  if (y < 0.3 && mix(seed + 1, sheet) % 4 == 0) return 0.15;
  const auto line = static_cast<std::uint32_t>(y * 16);
  return line % 2 == 0 && x < 0.5 + 0.4 * static_cast<double>(uniform_of(mix(seed + 2, sheet * 16 + line)))
             ? tone - 0.35
             : tone;
}

Texture paint_scene_texture(SceneTexture which, std::uint32_t s) {
  switch (which) {
    case kNatural:
      return paint(kNaturalSide, [s](double u, double v) { return natural(u, v, s + 1); });
    case kFacade:
      return paint(kSide, [s](double u, double v) { return facade(u, v, s + 200); });
    case kStreet:
      return paint(kSide, [s](double u, double v) { return 0.15 + 0.7 * natural(u, v, s + 300); });
    case kWallpaper:
      return paint(kSide, [s](double u, double v) { return 0.35 + 0.5 * natural(u, v, s + 400); });
    case kDoor:
      return paint(kSide, [s](double u, double v) {
        const bool panel = std::abs(u - 0.5) < 0.32 && (std::abs(v - 0.27) < 0.18 || std::abs(v - 0.72) < 0.2);
        return (panel ? 0.30 : 0.42) + 0.12 * (tile_noise(u * 0.25, v, 64, s + 500) - 0.5);
      });
    case kNotices:
      return paint(kSide, [s](double u, double v) { return notices(u, v, s + 600); });
    case kCarton:
      return paint(kSide, [s](double u, double v) {
        return (std::abs(u - 0.5) < 0.06 ? 0.75 : 0.5) + 0.25 * (natural(u, v, s + 700) - 0.5);
      });
    case kPlainFacade:
      return paint(kSide, [s](double u, double v) { return few_windows(u, v, s + 800); });
    case kSoft:
      return paint(kSide, [s](double u, double v) { return 0.5 + 0.16 * (natural(u, v, s + 900) - 0.5); });
    case kCloth:
      return paint(kSide, [s](double u, double v) { return cloth(u, v, s + 950); });
    case kGrain:
      return paint_detail();
    case kBlank:
      break;
  }
  return Texture(1, [](int, int) { return 1.0; });
}

}  // namespace

World empty_world(std::uint32_t seed, std::initializer_list<SceneTexture> used) {
  World world;
  for (int i = kBlank; i <= kCloth; ++i) {
    const auto which = static_cast<SceneTexture>(i);
    const bool needed = which == kGrain || std::find(used.begin(), used.end(), which) != used.end();
    world.textures.push_back(paint_scene_texture(needed ? which : kBlank, seed * 1000));
  }
  return world;
}

}  // namespace wasp::sim
