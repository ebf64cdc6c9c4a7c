// 5x5 median of a depth image, dense or at chosen pixels, through one sorting network in SIMD. Columns of five are
// sorted first and shared by the five windows they belong to; what is left picks the median of five sorted columns.
// No branch depends on the data. (Appendix A.3.2 asks for the filter; at this size a network beats a histogram.)
#pragma once

#include <cstdint>
#include <span>

#include "types/image_view.h"
#include "types/realtime.h"

namespace wasp::vision {

inline constexpr int kMaxMedianColumns = 2048, kMaxMedianRows = 32768;

/// Dense: out = the 13th smallest of the 25 values about each pixel; beyond the border the nearest pixel counts.
/// Every value takes part as it is, invalid 0 as the smallest and 65535 as the largest, exactly as in cv::medianBlur:
/// a pixel stays 0 only if 13 of its 25 neighbours are 0, smaller holes are filled, and beside a hole the result leans
/// to the nearer of the valid values. `out` has the shape of `depth`, `out_stride_px` elements from row to row, and
/// must not overlap it. False, with nothing written, for a bad view, null, a short stride, or above the limits.
/// Realtime-safe: yes.
bool median_5x5(const DepthView& depth, std::uint16_t* out, int out_stride_px) WASP_REALTIME;

struct DepthPixel {
  std::int16_t u_px = 0, v_px = 0;
};

/// At `pixels`: the median of the VALID values (not 0, not 65535) of each 5x5 window, borders as above. With an even
/// number of valid values it is one of the two middle ones. 0 where fewer than `min_valid` (1 ... 25) are valid or the
/// pixel lies outside the image. False, with `out` all 0, for a bad view, other sizes of `pixels` and `out`, or above
/// the limits. Time: fixed for each 32 pixels or part of it. Realtime-safe: yes.
bool median_5x5_at(const DepthView& depth, std::span<const DepthPixel> pixels, int min_valid,
                   std::span<std::uint16_t> out) WASP_REALTIME;

}  // namespace wasp::vision
