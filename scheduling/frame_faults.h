// What a camera can do to its pictures: corruption of one frame in memory, pure functions. Pixel (0, 0) is top left.
#pragma once

#include <span>

#include "scheduling/fault_random.h"
#include "types/messages.h"

namespace wasp::scheduling {

/// Pixels that may be written; rows are `stride_px` apart.
template <class T>
struct Pixels {
  T* data = nullptr;
  int width_px = 0, height_px = 0, stride_px = 0;
  [[nodiscard]] T* row(int v) const WASP_REALTIME { return data + static_cast<std::ptrdiff_t>(v) * stride_px; }
  [[nodiscard]] bool valid() const WASP_REALTIME { return data != nullptr; }
};
using GrayPixels = Pixels<std::uint8_t>;
using DepthPixels = Pixels<std::uint16_t>;  ///< millimetres, 0: no measurement

/// The pixels of a frame of `bytes` bytes, header first; not valid if the header does not describe such a frame.
GrayPixels gray_pixels(std::byte* frame, std::uint64_t bytes) WASP_REALTIME;
DepthPixels depth_pixels(std::byte* frame, std::uint64_t bytes) WASP_REALTIME;

// Grey images. Realtime-safe: yes, a few operations a pixel.
void fill_gray(const GrayPixels& image, float level) WASP_REALTIME;
/// Mean over (2 radius + 1)^2 pixels, fewer at the border. `scratch`: as many pixels as the image; `columns`: its
/// width.
void blur_gray(const GrayPixels& image, int radius_px, std::span<std::uint8_t> scratch,
               std::span<std::uint32_t> columns) WASP_REALTIME;
void add_noise(const GrayPixels& image, float sigma, FaultRandom& random) WASP_REALTIME;
/// So large a share of the rows, in the middle, is 0.
void kill_band(const GrayPixels& image, float share) WASP_REALTIME;
/// Below so large a share of the rows: the image before, of the same shape.
void tear(const GrayPixels& image, const GrayPixels& before, float share) WASP_REALTIME;
void multiply(const GrayPixels& image, float gain) WASP_REALTIME;

// Depth images. Realtime-safe: yes. A hole stays a hole, except for fill_depth.
/// Blocks of 8 x 8 pixels, so large a share of them, measure nothing.
void make_holes(const DepthPixels& image, float share, FaultRandom& random) WASP_REALTIME;
void add_bias(const DepthPixels& image, float bias_mm) WASP_REALTIME;
void quantise(const DepthPixels& image, float step_mm) WASP_REALTIME;
void add_noise(const DepthPixels& image, float sigma_mm, FaultRandom& random) WASP_REALTIME;
/// Every measurement is `depth_mm`; `holes_too`: every pixel.
void fill_depth(const DepthPixels& image, float depth_mm, bool holes_too) WASP_REALTIME;

}  // namespace wasp::scheduling
