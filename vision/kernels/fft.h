// FFTW (single precision) behind an owner with fixed buffers: plans and buffers are made at start, execution is free of
// heap, locks and failure. FFTW's planner keeps global state: make and destroy all plans on one thread, before the
// real-time threads start and after they end; executing different plans from different threads is safe.
#pragma once

#include <complex>
#include <memory>
#include <string>

#include "types/realtime.h"

struct fftwf_plan_s;

namespace wasp::vision {

/// How long the planner may try variants. Measured plans take about 0.1 s at start without wisdom.
enum class FftPlanning { kMeasure, kEstimate };

namespace detail {
struct FftFree {
  void operator()(void* p) const;
  void operator()(fftwf_plan_s* p) const;
};
}  // namespace detail

template <class T>
using FftBuffer = std::unique_ptr<T[], detail::FftFree>;

/// Aligned for FFTW's SIMD code, zeroed. Throws std::bad_alloc.
FftBuffer<float> fft_reals(std::size_t count);
FftBuffer<std::complex<float>> fft_complexes(std::size_t count);

/// In-place complex transform, exp(-j...), not normalised. Shape: rows x columns, row-major; rows = 1 is a 1-D
/// transform. Columns go in strips through a buffer of its own: FFTW's plans that do so take theirs from the heap at
/// every execution, and its plans that do not are up to twice as slow.
class ComplexFft {
 public:
  ComplexFft() = default;
  /// Throws std::invalid_argument for a size below 1, std::runtime_error when FFTW has no plan.
  ComplexFft(int rows, int columns, FftPlanning planning);
  [[nodiscard]] std::complex<float>* data() const WASP_REALTIME { return data_.get(); }
  /// Realtime-safe: yes.
  void execute() const WASP_REALTIME;

 private:
  using Plan = std::unique_ptr<fftwf_plan_s, detail::FftFree>;
  [[nodiscard]] Plan plan_strip(int columns, unsigned flags) const;
  void transform_strip(int column, int columns) const WASP_REALTIME;
  [[nodiscard]] int strip_pitch() const WASP_REALTIME { return rows_ + 8; }

  int rows_ = 0, columns_ = 0;
  FftBuffer<std::complex<float>> data_, middle_, strip_;  ///< between the passes; columns of a strip, one after another
  Plan along_rows_, along_strip_, along_rest_;
};

/// Real images to half spectra and back, not normalised. Real: rows x columns; spectrum: rows x (columns / 2 + 1).
/// The inverse destroys the spectrum.
class RealFft {
 public:
  RealFft() = default;
  RealFft(int rows, int columns, FftPlanning planning);
  [[nodiscard]] float* real() const WASP_REALTIME { return real_.get(); }
  [[nodiscard]] std::complex<float>* spectrum() const WASP_REALTIME { return spectrum_.get(); }
  /// Realtime-safe: yes, all.
  void forward() const WASP_REALTIME;
  void inverse() const WASP_REALTIME;

 private:
  FftBuffer<float> real_;
  FftBuffer<std::complex<float>> spectrum_;
  std::unique_ptr<fftwf_plan_s, detail::FftFree> forward_, inverse_;
};

/// Smallest size >= n that FFTW's codelets like: even, and made of factors 2, 3 and 5. At least 2.
int good_fft_size(int n) WASP_REALTIME;

/// What the planner has learnt, as text: keep it in a file beside the configuration and hand it back before the plans
/// are made, so that start-up measures nothing and picks the same plans every time. Realtime-safe: no.
std::string fft_wisdom();
bool use_fft_wisdom(const std::string& wisdom);

}  // namespace wasp::vision
