// Heading rate and height ratio as the thesis has them (5.3): both frames become log-polar maps about the image centre,
// blurred; in a few regions with much texture the phase correlation gives the shift, rows for the turn, columns for the
// growth; the answer is the mean over the regions. Needs a still optical centre: the floor moving under the camera by
// 2 px a frame already costs degrees (heading_log_polar_test.cpp shows it). heading_rate.h is the default for flight.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "types/realtime.h"
#include "vision/kernels/heading_rate.h"
#include "vision/kernels/image_shift.h"
#include "vision/kernels/log_polar.h"

namespace wasp::vision {

struct HeadingLogPolarParams {
  int regions = 6;                  ///< with the most texture, 1 ... kHeadingRegions
  int min_regions = 2;              ///< whose shift was found; fewer: invalid
  float min_variance = 200.f;       ///< of the region's grey values: less is no texture (5.2)
  float max_relative_sigma = 0.2f;  ///< of rows and columns [share of a region's side] between regions: more is invalid
};

/// The map is 256 x 256; its regions are 64 x 64 and do not overlap. The inner 128 columns, a disc of 11 px in a
/// 320 x 240 image, are not used: there is too little in them to tell a shift from.
inline constexpr int kHeadingMapSide = 256, kHeadingRegionSide = 64, kHeadingRegions = 8;

/// Keeps the last frame's map. One instance serves one camera and one thread.
class HeadingLogPolar {
 public:
  /// Makes tables, plans and buffers for images of this size. Throws std::invalid_argument for parameters out of range
  /// or an image without room for a map. Realtime-safe: no.
  HeadingLogPolar(int width_px, int height_px, int stride_px, const HeadingLogPolarParams& params = {});

  /// The motion since the frame before. Invalid for the first frame, for one that follows a bad one, without texture,
  /// or when the regions disagree. At most `regions` phase correlations. Realtime-safe: yes.
  HeadingRate step(const GrayView& image) WASP_REALTIME;

  /// Forgets the last frame. Realtime-safe: yes.
  void reset() WASP_REALTIME { has_last_ = false; }

 private:
  struct Region {
    int row = 0, column = 0;
    float variance = 0;
  };
  struct Shift {
    float turn_rad = 0, log_scale = 0;
  };
  void blur() WASP_REALTIME;
  int choose_regions() WASP_REALTIME;
  bool measure(const Region& region, Shift& out) WASP_REALTIME;
  [[nodiscard]] HeadingRate mean_of(int count) const WASP_REALTIME;

  HeadingLogPolarParams params_;
  LogPolarMap map_;
  ImageShiftPlan shift_;
  std::vector<std::uint8_t> last_, now_, sharp_;
  std::array<Region, kHeadingRegions> regions_{};
  std::array<Shift, kHeadingRegions> shifts_{};
  bool has_last_ = false;
};

}  // namespace wasp::vision
