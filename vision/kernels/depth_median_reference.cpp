#include "vision/kernels/depth_median_reference.h"

#include <algorithm>

namespace wasp::vision {
namespace {

/// Lower middle of the valid values, 0 if there are too few.
std::uint16_t median_of_valid(MedianWindow window, int min_valid) noexcept {
  std::uint16_t* const end =
      std::remove_if(std::begin(window.mm), std::end(window.mm), [](int mm) { return mm == 0 || mm == 65535; });
  const auto n = end - window.mm;
  if (n < std::max(min_valid, 1)) return 0;
  std::sort(window.mm, end);
  return window.mm[(n - 1) / 2];
}

}  // namespace

MedianWindow window_at(const DepthView& depth, int u, int v) noexcept {
  MedianWindow window;
  for (int dv = -2, i = 0; dv <= 2; ++dv) {
    const std::uint16_t* row = depth.row(std::clamp(v + dv, 0, depth.height_px - 1));
    for (int du = -2; du <= 2; ++du, ++i) window.mm[i] = row[std::clamp(u + du, 0, depth.width_px - 1)];
  }
  return window;
}

void median_5x5_reference(const DepthView& depth, std::uint16_t* out, int out_stride_px) noexcept {
  for (int v = 0; v < depth.height_px; ++v, out += out_stride_px)
    for (int u = 0; u < depth.width_px; ++u) {
      MedianWindow window = window_at(depth, u, v);
      std::nth_element(window.mm, window.mm + 12, window.mm + 25);
      out[u] = window.mm[12];
    }
}

void median_5x5_at_reference(const DepthView& depth, std::span<const DepthPixel> pixels, int min_valid,
                             std::span<std::uint16_t> out) noexcept {
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const DepthPixel at = pixels[i];
    const bool inside = at.u_px >= 0 && at.v_px >= 0 && at.u_px < depth.width_px && at.v_px < depth.height_px;
    out[i] = inside ? median_of_valid(window_at(depth, at.u_px, at.v_px), min_valid) : std::uint16_t{0};
  }
}

}  // namespace wasp::vision
