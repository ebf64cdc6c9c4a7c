// How well a cell's very centre matches at a first guess: a patch of 16 x 12 pixels, small enough to lie on one surface
// more often than the block does, with each difference limited so that the other surface does not decide.
#pragma once

#include <cstddef>
#include <cstdint>

#include "types/image_view.h"
#include "types/realtime.h"

namespace wasp::vision {

inline constexpr int kCentreWidthPx = 16, kCentreHeightPx = 12;
inline constexpr int kCentreMostGray = 20;

/// Mean absolute difference [grey, at most 20] between `first`'s patch with its top left pixel at (u_px, v_px) and
/// `second` that far away; the most where it leaves `second`. The patch must lie in `first`. Realtime-safe: yes.
float centre_cost(const GrayView& first, const GrayView& second, int u_px, int v_px, float shift_u,
                  float shift_v) WASP_REALTIME;

/// Top left pixels of the patch and of the whole pixel it moves to; parts of a pixel in 1/128 (u) and 1/32768 (v).
struct CentrePatch {
  const std::uint8_t *still = nullptr, *moved = nullptr;
  std::ptrdiff_t still_stride = 0, moved_stride = 0;
  int u_part = 0, v_part = 0;
};

/// 128 times the sum of the differences, as dispatched, and in plain loops for tests; the same integers.
int centre_sum(const CentrePatch& patch) WASP_REALTIME;
int centre_sum_plain(const CentrePatch& patch) WASP_REALTIME;

}  // namespace wasp::vision
