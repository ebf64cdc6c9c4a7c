// Grey out of the pixel layouts that cameras deliver. Pure; rows of the source lie `stride_bytes` apart, those of the
// result close together. Realtime-safe: yes.
#pragma once

#include <algorithm>
#include <cstdint>

#include "types/image_view.h"

namespace wasp::drivers {

/// Where the grey value of a pixel stands in a packed or planar source.
struct GrayLayout {
  int step_bytes = 1;    ///< from one pixel to the next: 1 GREY and the Y plane of NV12, 2 YUYV and UYVY
  int offset_bytes = 0;  ///< 1: UYVY
};

/// One source image: `bytes` at `data`.
struct PixelSource {
  const std::uint8_t* data = nullptr;
  int width_px = 0, height_px = 0, stride_bytes = 0;
  GrayLayout layout;
};

/// Rows [first, last) of `source` to their places in `gray`.
inline void copy_gray_rows(const PixelSource& source, int first, int last, std::uint8_t* gray) noexcept {
  for (int v = first; v < last; ++v) {
    const std::uint8_t* from = source.data + static_cast<std::ptrdiff_t>(v) * source.stride_bytes;
    std::uint8_t* to = gray + static_cast<std::ptrdiff_t>(v) * source.width_px;
    if (source.layout.step_bytes == 1) {
      std::copy_n(from, source.width_px, to);
    } else {
      from += source.layout.offset_bytes;
      for (int u = 0; u < source.width_px; ++u) to[u] = from[2 * u];
    }
  }
}

}  // namespace wasp::drivers
