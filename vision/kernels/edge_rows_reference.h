// The two sweeps of edge_rows as plain loops: what the SIMD form must equal to the last bit, and what runs where an
// image is narrower than one SIMD block.
#pragma once

#include <cstdint>

#include "types/realtime.h"
#include "vision/kernels/edge_rows.h"

namespace wasp::vision {

/// The second sweep's task; the first needs `image` and `kind` only. Views are valid and within the limits.
struct EdgeSweep {
  GrayView image;
  DepthView depth;  ///< looked at only if limit_mm > 0; then of the image's size
  EdgeKind kind = EdgeKind::kHorizontal;
  int threshold = 1;          ///< 1 ... 2,047
  int limit_mm = 0;           ///< edges at or beyond this depth do not count, 1 ... 64,999; 0: no mask
  bool mask_unknown = false;  ///< nor do those of unknown depth
};

/// Sum of squared gradients over interior pixels. Exact. Realtime-safe: yes.
std::uint64_t gradient_squares_reference(const GrayView& image, EdgeKind kind) WASP_REALTIME;

/// Fills out.count of the interior rows; touches nothing else. Realtime-safe: yes.
void count_rows_reference(const EdgeSweep& sweep, EdgeRows& out) WASP_REALTIME;

/// count_edge_rows on the scalar path throughout. Realtime-safe: yes.
void count_edge_rows_reference(const EdgeRowsParams& params, const GrayView& image, const DepthView& depth,
                               EdgeRows& out) WASP_REALTIME;

}  // namespace wasp::vision
