// Image shift as chapter 3 of the thesis prints it and compares it: references for tests, figures and benchmarks, not
// for flight. All share the Hann-windowed spectra of both images, F, and H = F2 conj(F1) (3.13).
#pragma once

#include <complex>
#include <vector>

#include "types/image_view.h"
#include "types/realtime.h"
#include "vision/kernels/fft.h"
#include "vision/kernels/image_shift.h"

namespace wasp::vision {

enum class ShiftMethod {
  kShearAverage,      ///< phase gradient (3.17)-(3.20); right for circular shifts only (image_shift_test.cpp shows it)
  kCrossCorrelation,  ///< peak of (3.14), whole pixels
  kCrossCorrelationSubpixel,  ///< the same with a parabola through the peak
  kKuglinHines,               ///< peak of the phase correlation (3.16), whole pixels
  kForoosh,                   ///< Foroosh et al. 2002: the peak and its higher neighbour on each axis
};
inline constexpr ShiftMethod kShiftMethods[] = {ShiftMethod::kShearAverage, ShiftMethod::kCrossCorrelation,
                                                ShiftMethod::kCrossCorrelationSubpixel, ShiftMethod::kKuglinHines,
                                                ShiftMethod::kForoosh};

/// Plans and buffers for one window size, sides 8 ... kMaxShiftSide. See fft.h for threads. Windows may be circular: a
/// plan made with `windowed` false takes the images as they are.
class ShiftReference {
 public:
  /// Throws std::invalid_argument for a bad size.
  ShiftReference(int width_px, int height_px, bool windowed = true, FftPlanning planning = FftPlanning::kEstimate);

  /// Motion from first to second as in ImageShift; `coefficient` and `quality` are (3.15) at the estimate's nearest
  /// whole pixel; valid says only that the input was good. Realtime-safe: yes.
  ImageShift estimate(ShiftMethod method, const GrayView& first, const GrayView& second) WASP_REALTIME;

 private:
  [[nodiscard]] std::size_t spectrum_size() const WASP_REALTIME;
  void transform(const GrayView& image, std::vector<std::complex<float>>& spectrum) WASP_REALTIME;
  void shear_average(ImageShift& out) const WASP_REALTIME;
  void correlate(bool phase_only) WASP_REALTIME;
  void find_peak(ShiftMethod method, ImageShift& out) const WASP_REALTIME;
  [[nodiscard]] float surface(int x, int y) const WASP_REALTIME;
  [[nodiscard]] double energy(const std::vector<std::complex<float>>& spectrum) const WASP_REALTIME;

  int width_px_, height_px_;
  RealFft fft_;
  std::vector<float> window_x_, window_y_;
  std::vector<std::complex<float>> first_, second_, product_;
};

}  // namespace wasp::vision
