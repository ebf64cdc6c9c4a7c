#include "vision/kernels/fft.h"

#include <fftw3.h>

#include <algorithm>
#include <cstdlib>
#include <new>
#include <stdexcept>

namespace wasp::vision {
namespace {

constexpr int kStrip = 8;  // columns transformed together: whole cache lines

/// Without buffered plans: they, two of three otherwise, take a buffer from the heap at every execution.
unsigned flags_of(FftPlanning planning) {
  return (planning == FftPlanning::kMeasure ? FFTW_MEASURE : FFTW_ESTIMATE) | FFTW_NO_BUFFERING;
}

std::size_t area(int rows, int columns) {
  if (rows < 1 || columns < 1) throw std::invalid_argument("FFT size below 1");
  return static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
}

std::size_t at(int row, int pitch, int column) noexcept {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(pitch) + static_cast<std::size_t>(column);
}

fftwf_complex* raw(std::complex<float>* p) { return reinterpret_cast<fftwf_complex*>(p); }

fftwf_plan checked(fftwf_plan plan) {
  if (plan == nullptr) throw std::runtime_error("FFTW made no plan");
  return plan;
}

}  // namespace

void detail::FftFree::operator()(void* p) const { fftwf_free(p); }
void detail::FftFree::operator()(fftwf_plan_s* p) const { fftwf_destroy_plan(p); }

FftBuffer<float> fft_reals(std::size_t count) {
  FftBuffer<float> buffer(fftwf_alloc_real(count));
  if (buffer == nullptr) throw std::bad_alloc();
  for (std::size_t i = 0; i < count; ++i) buffer[i] = 0.f;
  return buffer;
}

FftBuffer<std::complex<float>> fft_complexes(std::size_t count) {
  FftBuffer<std::complex<float>> buffer(reinterpret_cast<std::complex<float>*>(fftwf_alloc_complex(count)));
  if (buffer == nullptr) throw std::bad_alloc();
  for (std::size_t i = 0; i < count; ++i) buffer[i] = 0.f;
  return buffer;
}

ComplexFft::ComplexFft(int rows, int columns, FftPlanning planning)
    : rows_(rows), columns_(columns), data_(fft_complexes(area(rows, columns))) {
  const unsigned flags = flags_of(planning);
  fftwf_complex* const z = raw(data_.get());
  if (rows == 1) {
    along_rows_.reset(checked(fftwf_plan_dft_1d(columns, z, z, FFTW_FORWARD, flags)));
  } else {
    middle_ = fft_complexes(area(rows, columns));
    strip_ = fft_complexes(area(strip_pitch(), kStrip));
    along_rows_.reset(checked(fftwf_plan_many_dft(1, &columns, rows, z, nullptr, 1, columns, raw(middle_.get()),
                                                  nullptr, 1, columns, FFTW_FORWARD, flags)));
    if (columns >= kStrip) along_strip_ = plan_strip(kStrip, flags);
    if (columns % kStrip != 0) along_rest_ = plan_strip(columns % kStrip, flags);
  }
  for (std::size_t i = 0; i < area(rows, columns); ++i) data_[i] = 0.f;  // measuring left its own values
}

ComplexFft::Plan ComplexFft::plan_strip(int columns, unsigned flags) const {
  return Plan(checked(fftwf_plan_many_dft(1, &rows_, columns, raw(middle_.get()), nullptr, columns_, 1,
                                          raw(strip_.get()), nullptr, 1, strip_pitch(), FFTW_FORWARD, flags)));
}

void ComplexFft::execute() const noexcept {
  fftwf_execute(along_rows_.get());
  if (rows_ == 1) return;
  for (int column = 0; column < columns_; column += kStrip)
    transform_strip(column, std::min(kStrip, columns_ - column));
}

/// `column` is a multiple of kStrip, so that the strip is aligned as the planned one was.
void ComplexFft::transform_strip(int column, int columns) const noexcept {
  fftwf_execute_dft((columns == kStrip ? along_strip_ : along_rest_).get(), raw(middle_.get() + column),
                    raw(strip_.get()));
  for (int row = 0; row < rows_; ++row)
    for (int i = 0; i < columns; ++i) data_[at(row, columns_, column + i)] = strip_[at(i, strip_pitch(), row)];
}

RealFft::RealFft(int rows, int columns, FftPlanning planning)
    : real_(fft_reals(area(rows, columns))), spectrum_(fft_complexes(area(rows, columns / 2 + 1))) {
  const unsigned flags = flags_of(planning) | FFTW_DESTROY_INPUT;
  forward_.reset(checked(fftwf_plan_dft_r2c_2d(rows, columns, real_.get(), raw(spectrum_.get()), flags)));
  inverse_.reset(checked(fftwf_plan_dft_c2r_2d(rows, columns, raw(spectrum_.get()), real_.get(), flags)));
}

void RealFft::forward() const noexcept { fftwf_execute(forward_.get()); }
void RealFft::inverse() const noexcept { fftwf_execute(inverse_.get()); }

int good_fft_size(int n) noexcept {
  for (int size = n < 2 ? 2 : n + n % 2;; size += 2) {
    int rest = size;
    for (const int factor : {2, 3, 5})
      while (rest % factor == 0) rest /= factor;
    if (rest == 1) return size;
  }
}

std::string fft_wisdom() {
  char* text = fftwf_export_wisdom_to_string();
  std::string wisdom = text != nullptr ? text : "";
  std::free(text);
  return wisdom;
}

bool use_fft_wisdom(const std::string& wisdom) { return fftwf_import_wisdom_from_string(wisdom.c_str()) != 0; }

}  // namespace wasp::vision
