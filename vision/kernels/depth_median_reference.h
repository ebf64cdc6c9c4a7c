// The 5x5 median by partial sorting, pixel by pixel: what the network must equal, and what runs on images narrower
// than one SIMD vector.
#pragma once

#include "types/realtime.h"
#include "vision/kernels/depth_median.h"

namespace wasp::vision {

/// Values of a 5x5 window, borders replicated.
struct MedianWindow {
  std::uint16_t mm[25];
};
MedianWindow window_at(const DepthView& depth, int u, int v) WASP_REALTIME;

/// As median_5x5 and median_5x5_at, arguments already checked. Realtime-safe: yes.
void median_5x5_reference(const DepthView& depth, std::uint16_t* out, int out_stride_px) WASP_REALTIME;
void median_5x5_at_reference(const DepthView& depth, std::span<const DepthPixel> pixels, int min_valid,
                             std::span<std::uint16_t> out) WASP_REALTIME;

}  // namespace wasp::vision
