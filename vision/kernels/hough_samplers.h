// The four ways to draw 3-tuples of pixels for the randomized Hough transform (thesis 6.2.4.1, fig. 6.18). Tuples are
// drawn once, at start-up, and reused for every frame. All but `local (Cartesian)` live in the image alone; that one
// draws as `naive` does and drops, per frame, tuples whose points lie more than d_max apart.
#pragma once

#include <array>
#include <cstdint>

#include "types/realtime.h"

namespace wasp::vision {

enum class HoughSampler : std::uint8_t { kNaive, kLocalCartesian, kLocalImage, kOrthogonal };

inline constexpr int kHoughTuples = 4096;

struct PixelTuple {
  std::array<std::uint16_t, 3> u_px{}, v_px{};
};

struct HoughSamplerParams {
  HoughSampler sampler = HoughSampler::kOrthogonal;
  float local_sigma_share = 0.08f;     ///< local (image): Gaussian sigma, share of the image width
  float orthogonal_mean_share = 0.1f;  ///< orthogonal: mean distance, share of the image width
  int gamma_shape = 3;                 ///< orthogonal: shape of the gamma distribution, 1 ... 8
  std::uint32_t seed = 1;
};

/// Fills `tuples` with pixels inside width x height (both at least 8). Realtime-safe: bounded, but meant for start-up.
void draw_tuples(const HoughSamplerParams& params, int width_px, int height_px,
                 std::array<PixelTuple, kHoughTuples>& tuples) WASP_REALTIME;

}  // namespace wasp::vision
