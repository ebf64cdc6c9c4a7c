// Horizontal edges counted by row, in two passes over the image and no intermediate image: Sobel (7.32), threshold at
// the RMS of the gradient (7.33), row sums (7.34). The first pass only sums squares, the second counts; both work in
// integers wide enough for any Sobel value of 8-bit pixels (at most 1,020), so the result is exact.
#pragma once

#include <array>
#include <cstdint>

#include "types/image_view.h"
#include "types/realtime.h"

namespace wasp::vision {

inline constexpr int kMaxEdgeRows = 1088;     ///< image height limit
inline constexpr int kMaxEdgeColumns = 2048;  ///< image width limit

/// Which edges count. Horizontal ones getting brighter downwards only, as (7.33) prints; horizontal ones of both
/// polarities, as (7.9) and flies have it; or edges of any direction by the gradient's magnitude, for a camera that
/// looks straight down, where "horizontal" depends on heading.
enum class EdgeKind : std::uint8_t { kBrighterBelow, kHorizontal, kAnyDirection };

struct EdgeRowsParams {
  EdgeKind kind = EdgeKind::kHorizontal;
  int min_threshold = 8;      ///< Sobel units: below this the RMS is sensor noise, not structure
  int fixed_threshold = 0;    ///< Sobel units; > 0: used instead of the RMS (a lens out of focus sets the scale)
  float mask_beyond_m = 0.f;  ///< edges at or beyond this depth do not count (7.41); 0 switches the mask off
  bool mask_unknown = false;  ///< an edge without a depth reading counts as far: masked too
};

/// Row histogram. Rows 0 and height-1 and columns 0 and width-1 have no Sobel value and no edges.
struct EdgeRows {
  bool valid = false;
  int width_px = 0, height_px = 0;
  int threshold = 0;                               ///< k_s: smallest |G| that counts
  float gradient_rms = 0;                          ///< Sobel units
  std::int64_t total = 0;                          ///< edge pixels
  std::array<std::int32_t, kMaxEdgeRows> count{};  ///< E_v, by image row
};

/// Counts edges of `image`. `depth` (same size; 0 and 65,535 = unknown) may be empty: then nothing is masked. Invalid
/// for a bad view, fewer than 3 x 3 pixels or a larger image than the limits. Realtime-safe: yes.
void count_edge_rows(const EdgeRowsParams& params, const GrayView& image, const DepthView& depth,
                     EdgeRows& out) WASP_REALTIME;

}  // namespace wasp::vision
