// What two images of floats share at a shift: sums for their correlation, as SIMD functions (Highway picks the widest
// instruction set the processor has, once, at the first call). Realtime-safe: yes, all.
#pragma once

#include "types/realtime.h"

namespace wasp::vision::shift {

/// Largest of `count` values, 1 at least.
float max_of(const float* values, int count) WASP_REALTIME;

/// Sums over the overlap of two images for the normalised coefficient (3.15).
struct OverlapSums {
  float a = 0, b = 0, aa = 0, bb = 0, ab = 0;
};
OverlapSums overlap_sums(const float* a, const float* b, int pitch, int rows, int columns) WASP_REALTIME;

}  // namespace wasp::vision::shift
