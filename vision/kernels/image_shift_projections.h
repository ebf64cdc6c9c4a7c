// Image shift from row and column sums: two one-dimensional correlations instead of a two-dimensional one. Fastest of
// all and good for small shifts of textured scenes; the windows' unshared borders enter every sum, so it is less
// accurate than ImageShiftPlan and knows less about its failures. A named variant, not the default.
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include "types/image_view.h"
#include "types/realtime.h"
#include "vision/kernels/fft.h"
#include "vision/kernels/image_shift.h"

namespace wasp::vision {

struct ShiftProjectionsParams {
  float max_shift = 0.5f;          ///< largest shift looked for, as a share of the side, 0 ... 0.75
  float least_coefficient = 0.5f;  ///< below it, or below what chance reaches, `valid` is false
  FftPlanning planning = FftPlanning::kMeasure;
};

/// Plans and buffers for one window size. One instance serves one thread at a time.
class ShiftProjections {
 public:
  /// Sides kMinShiftSide ... kMaxShiftSide. See fft.h for threads. Throws std::invalid_argument.
  ShiftProjections(int width_px, int height_px, const ShiftProjectionsParams& params = {});

  /// As ImageShiftPlan::estimate; `coefficient` and `quality` are the lower of the two axes' normalised correlations of
  /// the sums' differences. Fixed work. Realtime-safe: yes.
  ImageShift estimate(const GrayView& first, const GrayView& second) WASP_REALTIME;

 private:
  struct Axis {
    int count = 0, most = 0;  ///< differences of neighbouring sums; largest shift [px]
    int padded = 0;           ///< at least 2 count: no wrap
    RealFft fft;
    std::vector<std::complex<float>> spectrum;  ///< of the first
    std::vector<float> first, second, energy_first, energy_second;
  };
  struct Match {
    float shift_px = 0, coefficient = 0;
  };

  void size_axis(Axis& axis, int side) const;
  void project(const GrayView& image, int x, int y, int columns, int rows, std::vector<float>& across,
               std::vector<float>& down) WASP_REALTIME;
  static void transform(const Axis& axis, const std::vector<float>& values) WASP_REALTIME;
  static Match search(Axis& axis) WASP_REALTIME;
  static Match refine(const Axis& axis, int count) WASP_REALTIME;
  static float coefficient(const Axis& axis, int count, int lag) WASP_REALTIME;

  int width_px_, height_px_;
  ShiftProjectionsParams params_;
  Axis across_, down_;
  std::vector<std::uint16_t> band_;
  std::vector<std::uint32_t> columns_;
};

}  // namespace wasp::vision
