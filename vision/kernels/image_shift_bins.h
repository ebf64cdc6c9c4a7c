// Binning of image_shift: 8-bit windows to smaller images of floats, as SIMD functions (Highway picks the widest
// instruction set the processor has, once, at the first call). Realtime-safe: yes, all.
#pragma once

#include "types/image_view.h"
#include "types/realtime.h"

namespace wasp::vision::shift {

inline constexpr int kMaxSide = 2048;    ///< pixels of a window's side
inline constexpr int kMaxBin = 4;        ///< 2 x 2 pixels a half bin x 64 still fit 16 bits
inline constexpr int kLanesMargin = 16;  ///< floats that rows may be read past their end

/// Bins of bin x bin pixels (bin a power of two up to kMaxBin) from pixel (x, y), rows x columns of them, `pitch`
/// floats a row. Each bin weighs 1 3 3 1 (by 1 3 3 1) the half bins about it, up to a scale: plain sums would alias,
/// and aliases move the wrong way. Half bins beyond the area repeat its edge. The pixels must lie inside the view.
void bin_image(const GrayView& image, int x, int y, int bin, int rows, int columns, float* out,
               int pitch) WASP_REALTIME;

/// The same from binned to twice as coarse: rows and columns are the result's.
void halve_image(const float* in, int in_pitch, int rows, int columns, float* out, int pitch) WASP_REALTIME;

}  // namespace wasp::vision::shift
