// Image shift in the frequency domain, the mended default. A coarse whole-bin peak of the phase correlation; both
// windows cut again to what they share, so that only a fraction of a bin is left; then Newton's method on the
// correlation peak evaluated from the spectrum (no second inverse FFT, no interpolation). Large windows are binned
// first.
//
// What is printed as shear average (3.17-3.20) is in image_shift_reference.h, with the others it is compared with.
#pragma once

#include <vector>

#include "types/image_view.h"
#include "types/realtime.h"
#include "vision/kernels/fft.h"
#include "vision/kernels/image_shift_bins.h"
#include "vision/kernels/image_shift_check.h"
#include "vision/kernels/image_shift_overlap.h"
#include "vision/kernels/image_shift_spectrum.h"

namespace wasp::vision {

inline constexpr int kMinShiftSide = 32, kMaxShiftSide = 512;  ///< window side [px]

struct ImageShiftParams {
  float max_shift = 0.5f;    ///< largest shift looked for, as a share of the side, 0 ... 0.75
  float min_quality = 0.1f;  ///< below it, or below what chance reaches, `valid` is false
  float most_rival = 0.6f;   ///< `valid` is false where another shift is nearly as likely, as on a chequered floor
  float most_error_px =
      0.25f;           ///< `valid` is false where noise alone makes the estimate less certain (standard deviation)
  float band = 0.19f;  ///< width (sigma) of the Gaussian band limit [cycles per bin]
  FftPlanning planning = FftPlanning::kMeasure;
};

/// Motion of the image content from the first window to the second: a point at (u, v) moves to (u + x, v + y). Where
/// the content also turns or grows it is the motion of the window's middle.
struct ImageShift {
  float x_px = 0, y_px = 0;  ///< right and down
  float coefficient = 0;     ///< normalised correlation at the peak (3.15), in the band, -1 ... 1
  float quality = 0;         ///< share of the whitened spectrum whose phase agrees with the shift, 0 ... 1
  float least_quality = 0;   ///< what `quality` had to reach to be valid, from the size of the overlap
  float rival = 0;           ///< likelihood of the best shift elsewhere over that of the one taken, 0 ... 1
  float texture = 0;         ///< gradient in its weakest direction over what noise alone would show
  float error_px = 0;        ///< standard deviation of an affine fit's middle, from the difference that is left
  int candidates = 0;        ///< shifts compared, 1 ... ImageShiftPlan::kCandidates
  int fits = 0;              ///< steps of the affine fit, 1 ... shift::kMostFits
  bool warped = false;       ///< the content turns or grows: x and y come from the affine fit
  bool valid = false;        ///< false: bad input, no texture, no single peak, no agreement; do not use the shift
};

/// Plans, tables and buffers for one window size. One instance serves one thread at a time.
class ImageShiftPlan {
 public:
  static constexpr int kCandidates = 16;

  /// Sides kMinShiftSide ... kMaxShiftSide. Makes FFTW plans (see fft.h for threads). Throws std::invalid_argument.
  ImageShiftPlan(int width_px, int height_px, const ImageShiftParams& params = {});

  /// Both views must have the plan's size; otherwise the result is invalid. At most kCandidates candidates, two passes
  /// of five Newton steps and shift::kMostFits steps of the affine fit; the time does not depend on the content beyond
  /// that. Realtime-safe: yes.
  ImageShift estimate(const GrayView& first, const GrayView& second) WASP_REALTIME;

 private:
  struct Level {
    int bin = 1, columns = 0, rows = 0, pitch = 0;  ///< bins
    std::vector<float> first, second;
  };
  struct Spectrum {
    ComplexFft fft;
    int rows = 0, columns = 0;
    std::vector<float> h_re, h_im, g_re, g_im, weight_x, weight_y;
    shift::Band h, g;
  };
  struct Offset {
    float x = 0, y = 0;
  };
  struct Peak {
    int x = 0, y = 0;  ///< surface steps
    float value = 0;
  };
  struct Search {
    int x = 0, y = 0;  ///< surface steps either way
  };

  // image_shift.cpp
  void size_level(Level& level, int bin) const;
  void size_spectrum(Spectrum& spectrum, const Level& level, double band, double sigma) const;
  void bin_both(const GrayView& first, const GrayView& second) WASP_REALTIME;
  bool measure(const GrayView& second, Offset& found, ImageShift& out) WASP_REALTIME;
  void check(Offset found, ImageShift& out) WASP_REALTIME;

  /// halved_, or fine_ where the windows are too small to halve.
  [[nodiscard]] const Level& coarse() const WASP_REALTIME { return halved_.columns > 0 ? halved_ : fine_; }

  // image_shift_coarse.cpp
  bool coarse_shift(Offset& found, ImageShift& out) WASP_REALTIME;
  void correlate_coarse() WASP_REALTIME;
  [[nodiscard]] shift::ImagePair coarse_pair(Offset at) const WASP_REALTIME;
  [[nodiscard]] shift::OverlapSums overlap(Offset at) const WASP_REALTIME;
  [[nodiscard]] float likelihood(Offset at) const WASP_REALTIME;
  [[nodiscard]] Peak highest() const WASP_REALTIME;
  [[nodiscard]] Offset vertex(const Peak& peak) const WASP_REALTIME;
  void measure_row(int v) WASP_REALTIME;
  void remove(const Peak& peak) WASP_REALTIME;
  [[nodiscard]] float& surface_at(int u, int v) const WASP_REALTIME {
    const int row = v < 0 ? v + surface_rows_ : v, column = u < 0 ? u + surface_columns_ : u;
    return surface_.real()[row * surface_columns_ + column];
  }

  // image_shift_fine.cpp
  bool fine_shift(const GrayView& second, Offset start, Offset& found, ImageShift& out) WASP_REALTIME;
  bool climb(const Spectrum& spectrum, Offset& at, shift::PeakSums& peak, int steps) WASP_REALTIME;
  void set_phasors(const Spectrum& spectrum, Offset at) WASP_REALTIME;
  void pack(const Spectrum& spectrum, const float* first, const float* second, int pitch, int rows,
            int columns) WASP_REALTIME;
  [[nodiscard]] const float* window(int bins) const WASP_REALTIME { return windows_.data() + bins * window_pitch_; }

  int width_px_, height_px_;
  ImageShiftParams params_;
  Level fine_, halved_;
  std::vector<float> recut_;  ///< the second window binned again from its shifted origin, as fine_
  Spectrum coarse_spectrum_, fine_spectrum_;
  RealFft surface_;
  std::vector<float> row_peak_, windows_, check_weights_, ex_re_, ex_im_, ey_re_, ey_im_;
  Search search_;
  int window_pitch_ = 0, surface_rows_ = 0, surface_columns_ = 0;
};

}  // namespace wasp::vision
