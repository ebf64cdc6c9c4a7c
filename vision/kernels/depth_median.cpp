// Checks of the arguments; the work is vision/kernels/depth_median_simd.cpp.
#include "vision/kernels/depth_median.h"

#include <algorithm>

#include "vision/kernels/depth_median_simd.h"

namespace wasp::vision {
namespace {

bool usable(const DepthView& depth) noexcept {
  return depth.valid() && depth.width_px <= kMaxMedianColumns && depth.height_px <= kMaxMedianRows;
}

}  // namespace

bool median_5x5(const DepthView& depth, std::uint16_t* out, int out_stride_px) noexcept {
  if (!usable(depth) || out == nullptr || out_stride_px < depth.width_px) return false;
  median_5x5_simd(depth, out, out_stride_px);
  return true;
}

bool median_5x5_at(const DepthView& depth, std::span<const DepthPixel> pixels, int min_valid,
                   std::span<std::uint16_t> out) noexcept {
  if (!usable(depth) || pixels.size() != out.size()) {
    std::fill(out.begin(), out.end(), std::uint16_t{0});
    return false;
  }
  median_5x5_at_simd(depth, pixels, std::clamp(min_valid, 1, 25), out);
  return true;
}

}  // namespace wasp::vision
