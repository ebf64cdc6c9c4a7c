// Image pyramid for optical flow: level 0 is the caller's image, each further level halves it through the separable
// filter (1 3 3 1)/8, which sits between two pixels: pixel i of a level lies at 2 i + 1/2 of the level below. Columns
// are blended by averages of two bytes, which round up: every level is up to half a grey level brighter, in both
// images. Memory is taken once, in the constructor.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "types/image_view.h"
#include "types/realtime.h"

namespace wasp::vision {

class FlowPyramid {
 public:
  static constexpr int kMaxLevels = 5;
  static constexpr int kMostLanes = 64;  ///< bytes in the widest vector: strides are multiples of two
  static constexpr int kScratchRows = 8;
  static constexpr int scratch_bytes(int readable_px) { return kScratchRows * (readable_px + 6 * kMostLanes); }
  /// Smallest side of a level [px]: a block of 3 x 3 tiles, its border, and room to move.
  static constexpr int kMinSidePx = 28;

  /// Makes room for `levels` (1 ... kMaxLevels) levels, fewer where a side would fall below kMinSidePx. Allocates.
  FlowPyramid(int width_px, int height_px, int levels);

  /// Fills the levels from `image`, which must outlive their use. False (and no level) for a bad view or another size.
  /// Realtime-safe: yes.
  bool build(const GrayView& image) WASP_REALTIME;
  /// Keeps all levels but the lowest, of which `image` is another copy. False for a bad view or another size.
  /// Realtime-safe: yes.
  bool renew(const GrayView& image) WASP_REALTIME;

  [[nodiscard]] int levels() const WASP_REALTIME { return levels_; }
  [[nodiscard]] const GrayView& level(int i) const WASP_REALTIME { return views_[static_cast<std::size_t>(i)]; }

 private:
  [[nodiscard]] bool fits(const GrayView& image) const WASP_REALTIME;

  int width_px_, height_px_, levels_ = 0;
  std::array<GrayView, kMaxLevels> views_{};
  std::array<std::vector<std::uint8_t>, kMaxLevels> pixels_;
  std::vector<std::uint8_t> row_;
};

/// One halving step: `out` holds (width/2) x (height/2) pixels, row after row with `out_stride_px`, which must leave
/// room for a multiple of kMostLanes. Of every row of `in` the first `readable_px` (>= width) bytes may be read.
/// `scratch` holds scratch_bytes(readable_px). SIMD, the same result on every machine. Realtime-safe: yes.
void halve_image(const GrayView& in, int readable_px, std::uint8_t* out, int out_stride_px,
                 std::uint8_t* scratch) WASP_REALTIME;

}  // namespace wasp::vision
