// The 5x5 median in SIMD, dispatched at run time to the widest instruction set of the machine.
#pragma once

#include "types/realtime.h"
#include "vision/kernels/depth_median.h"

namespace wasp::vision {

/// As the functions of depth_median_reference.h, to the last bit; arguments already checked. Realtime-safe: yes.
void median_5x5_simd(const DepthView& depth, std::uint16_t* out, int out_stride_px) WASP_REALTIME;
void median_5x5_at_simd(const DepthView& depth, std::span<const DepthPixel> pixels, int min_valid,
                        std::span<std::uint16_t> out) WASP_REALTIME;

}  // namespace wasp::vision
