// Checks and the threshold; the sweeps are vision/kernels/edge_rows_simd.cpp and, in plain loops, edge_rows_reference.
#include "vision/kernels/edge_rows.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/edge_rows_reference.h"
#include "vision/kernels/edge_rows_simd.h"

namespace wasp::vision {
namespace {

struct Sweeps {
  std::uint64_t (*squares)(const GrayView&, EdgeKind) WASP_REALTIME;
  void (*count)(const EdgeSweep&, EdgeRows&) WASP_REALTIME;
};

bool usable(const GrayView& image) noexcept {
  return image.valid() && image.width_px >= 3 && image.height_px >= 3 && image.width_px <= kMaxEdgeColumns &&
         image.height_px <= kMaxEdgeRows;
}

/// Millimetres from which edges are masked; 0 for no mask.
int mask_limit_mm(const EdgeRowsParams& params, const GrayView& image, const DepthView& depth) noexcept {
  const bool wanted = params.mask_beyond_m > 0.f && params.mask_beyond_m < 65.f;  // false for NaN
  const bool fits = depth.valid() && depth.width_px == image.width_px && depth.height_px == image.height_px;
  return wanted && fits ? std::max(1, static_cast<int>(params.mask_beyond_m * 1000.f)) : 0;
}

void run(const Sweeps& sweeps, const EdgeRowsParams& params, const GrayView& image, const DepthView& depth,
         EdgeRows& out) noexcept {
  out = {};
  if (!usable(image)) return;
  out.valid = true;
  out.width_px = image.width_px;
  out.height_px = image.height_px;
  const double pixels = static_cast<double>(image.width_px - 2) * (image.height_px - 2);
  const double rms = std::sqrt(static_cast<double>(sweeps.squares(image, params.kind)) / pixels);
  out.gradient_rms = static_cast<float>(rms);
  out.threshold = params.fixed_threshold > 0
                      ? std::min(params.fixed_threshold, 2047)
                      : std::max(std::clamp(params.min_threshold, 1, 1024), static_cast<int>(std::ceil(rms)));
  sweeps.count({image, depth, params.kind, out.threshold, mask_limit_mm(params, image, depth), params.mask_unknown},
               out);
  for (int v = 1; v < image.height_px - 1; ++v) out.total += out.count[static_cast<std::size_t>(v)];
}

}  // namespace

void count_edge_rows(const EdgeRowsParams& params, const GrayView& image, const DepthView& depth,
                     EdgeRows& out) noexcept {
  run({&gradient_squares, &count_rows}, params, image, depth, out);
}

void count_edge_rows_reference(const EdgeRowsParams& params, const GrayView& image, const DepthView& depth,
                               EdgeRows& out) noexcept {
  run({&gradient_squares_reference, &count_rows_reference}, params, image, depth, out);
}

}  // namespace wasp::vision
