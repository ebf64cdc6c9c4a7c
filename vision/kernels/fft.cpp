#include "vision/kernels/fft.h"

#include <fftw3.h>

#include <cstdlib>
#include <new>
#include <stdexcept>

namespace wasp::vision {
namespace {

unsigned flags_of(FftPlanning planning) { return planning == FftPlanning::kMeasure ? FFTW_MEASURE : FFTW_ESTIMATE; }

std::size_t area(int rows, int columns) {
  if (rows < 1 || columns < 1) throw std::invalid_argument("FFT size below 1");
  return static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
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

ComplexFft::ComplexFft(int rows, int columns, FftPlanning planning) : data_(fft_complexes(area(rows, columns))) {
  fftwf_complex* const z = raw(data_.get());
  const int sizes[2] = {rows, columns};
  const bool line = rows == 1;
  plan_.reset(checked(fftwf_plan_dft(line ? 1 : 2, line ? sizes + 1 : sizes, z, z, FFTW_FORWARD, flags_of(planning))));
  for (std::size_t i = 0; i < area(rows, columns); ++i) data_[i] = 0.f;  // measuring left its own values
}

void ComplexFft::execute() const noexcept { fftwf_execute(plan_.get()); }

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
