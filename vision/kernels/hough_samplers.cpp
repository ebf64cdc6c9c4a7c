// A point that would fall outside the image is drawn again, at most kRetries times, then clamped to the border.
#include "vision/kernels/hough_samplers.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "vision/kernels/pseudo_random.h"

namespace wasp::vision {
namespace {

constexpr int kRetries = 16;

struct Offset {
  float u, v;
};

struct Drawer {
  const HoughSamplerParams& params;
  int width_px, height_px;
  PseudoRandom random;

  float exponential() noexcept { return -std::log(1.f - random.uniform()); }
  /// Mean 1, shape k: the sum of k exponentials, over k.
  float gamma() noexcept {
    const int k = std::clamp(params.gamma_shape, 1, 8);
    float sum = 0.f;
    for (int i = 0; i < k; ++i) sum += exponential();
    return sum / static_cast<float>(k);
  }
  Offset gaussian() noexcept {
    const float r = params.local_sigma_share * static_cast<float>(width_px) * std::sqrt(2.f * exponential());
    const float angle = 2.f * std::numbers::pi_v<float> * random.uniform();
    return {r * std::cos(angle), r * std::sin(angle)};
  }
  Offset gamma_ring() noexcept {
    const float r = params.orthogonal_mean_share * static_cast<float>(width_px) * gamma();
    const float angle = 2.f * std::numbers::pi_v<float> * random.uniform();
    return {r * std::cos(angle), r * std::sin(angle)};
  }
  [[nodiscard]] bool inside(const PixelTuple& t, Offset o) const noexcept {
    const float u = static_cast<float>(t.u_px[0]) + o.u, v = static_cast<float>(t.v_px[0]) + o.v;
    return u >= 0.f && v >= 0.f && u < static_cast<float>(width_px) && v < static_cast<float>(height_px);
  }
  void set(PixelTuple& t, std::size_t i, Offset o) const noexcept {
    const auto at = [](float x, int size) {
      return static_cast<std::uint16_t>(std::clamp(x, 0.f, static_cast<float>(size - 1)));
    };
    t.u_px[i] = at(static_cast<float>(t.u_px[0]) + o.u, width_px);
    t.v_px[i] = at(static_cast<float>(t.v_px[0]) + o.v, height_px);
  }
  void set_uniform(PixelTuple& t, std::size_t i) noexcept {
    t.u_px[i] = static_cast<std::uint16_t>(random.below(width_px));
    t.v_px[i] = static_cast<std::uint16_t>(random.below(height_px));
  }
  void set_gaussian(PixelTuple& t, std::size_t i) noexcept {
    Offset o = gaussian();
    for (int k = 0; k < kRetries && !inside(t, o); ++k) o = gaussian();
    set(t, i, o);
  }
  void set_orthogonal(PixelTuple& t) noexcept {
    Offset o = gamma_ring();
    for (int k = 0; k < kRetries && !(inside(t, o) && inside(t, {-o.v, o.u})); ++k) o = gamma_ring();
    set(t, 1, o);
    set(t, 2, {-o.v, o.u});
  }
  PixelTuple draw() noexcept {
    PixelTuple t;
    set_uniform(t, 0);
    switch (params.sampler) {
      case HoughSampler::kNaive:
      case HoughSampler::kLocalCartesian:
        for (const std::size_t i : {1u, 2u}) set_uniform(t, i);
        break;
      case HoughSampler::kLocalImage:
        for (const std::size_t i : {1u, 2u}) set_gaussian(t, i);
        break;
      case HoughSampler::kOrthogonal:
        set_orthogonal(t);
        break;
    }
    return t;
  }
};

}  // namespace

void draw_tuples(const HoughSamplerParams& params, int width_px, int height_px,
                 std::array<PixelTuple, kHoughTuples>& tuples) noexcept {
  Drawer drawer{params, std::clamp(width_px, 8, 65535), std::clamp(height_px, 8, 65535), {params.seed * 2654435761u}};
  for (PixelTuple& tuple : tuples) tuple = drawer.draw();
}

}  // namespace wasp::vision
