#include "vision/kernels/image_shift_reference.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace wasp::vision {
namespace {

using Complex = std::complex<float>;
constexpr double kTurn = 2.0 * std::numbers::pi;

std::size_t size(int a) { return static_cast<std::size_t>(a); }

std::vector<float> window(int n, bool hann) {
  std::vector<float> w(size(n), 1.f);
  for (int i = 0; hann && i < n; ++i) w[size(i)] = static_cast<float>(0.5 - 0.5 * std::cos(kTurn * (i + 0.5) / n));
  return w;
}

/// Distance of a parabola's vertex from the middle of three samples.
float parabola(float low, float mid, float high) WASP_REALTIME {
  const float bend = low - 2.f * mid + high;
  return bend < 0.f ? 0.5f * (low - high) / bend : 0.f;
}

/// Foroosh: the peak c0 and its higher neighbour c1 lie c1 / (c1 + c0) from the true shift (a Dirichlet kernel).
float side_peak(float low, float mid, float high) WASP_REALTIME {
  const float c1 = std::max(low, high);
  if (!(c1 > 0.f) || !(c1 + mid > 0.f)) return 0.f;
  return (high > low ? 1.f : -1.f) * c1 / (c1 + mid);
}

int wrapped(int k, int n) noexcept { return k < 0 ? k + n : k >= n ? k - n : k; }
int centred(int k, int n) noexcept { return k > n / 2 ? k - n : k; }

}  // namespace

ShiftReference::ShiftReference(int width_px, int height_px, bool windowed, FftPlanning planning)
    : width_px_(width_px), height_px_(height_px) {
  if (std::min(width_px, height_px) < 8 || std::max(width_px, height_px) > kMaxShiftSide)
    throw std::invalid_argument("shift reference: window side outside 8 ... 512 px");
  fft_ = RealFft(height_px, width_px, planning);
  window_x_ = window(width_px, windowed);
  window_y_ = window(height_px, windowed);
  for (auto* spectrum : {&first_, &second_, &product_}) spectrum->resize(spectrum_size());
}

std::size_t ShiftReference::spectrum_size() const noexcept { return size(height_px_) * size(width_px_ / 2 + 1); }

void ShiftReference::transform(const GrayView& image, std::vector<Complex>& spectrum) noexcept {
  for (int v = 0; v < height_px_; ++v)
    for (int u = 0; u < width_px_; ++u)
      fft_.real()[v * width_px_ + u] = window_x_[size(u)] * window_y_[size(v)] * static_cast<float>(image.row(v)[u]);
  fft_.forward();
  std::copy(fft_.spectrum(), fft_.spectrum() + spectrum_size(), spectrum.begin());
}

/// The half spectrum is enough: the other half repeats its terms. Neither axis is summed across the wrap.
void ShiftReference::shear_average(ImageShift& out) const noexcept {
  const int half = width_px_ / 2 + 1, wrap = height_px_ / 2;
  std::complex<double> along_u = 0, along_v = 0;
  const auto h = [&](int u, int v) { return std::complex<double>(product_[size(v) * size(half) + size(u)]); };
  for (int v = 0; v < height_px_; ++v)
    for (int u = 0; u < half; ++u) {
      if (u + 1 < half) along_u += h(u + 1, v) * std::conj(h(u, v));
      if (v + 1 < height_px_ && v + 1 != wrap) along_v += h(u, v + 1) * std::conj(h(u, v));
    }
  out.x_px = static_cast<float>(-width_px_ * std::arg(along_u) / kTurn);
  out.y_px = static_cast<float>(-height_px_ * std::arg(along_v) / kTurn);
}

void ShiftReference::correlate(bool phase_only) noexcept {
  for (std::size_t i = 0; i < spectrum_size(); ++i) {
    const float magnitude = std::abs(product_[i]);
    fft_.spectrum()[i] = !phase_only ? product_[i] : magnitude > 0.f ? product_[i] / magnitude : Complex{};
  }
  fft_.inverse();
}

float ShiftReference::surface(int x, int y) const noexcept {
  return fft_.real()[wrapped(y, height_px_) * width_px_ + wrapped(x, width_px_)];
}

void ShiftReference::find_peak(ShiftMethod method, ImageShift& out) const noexcept {
  const float* begin = fft_.real();
  const int at = static_cast<int>(std::max_element(begin, begin + width_px_ * height_px_) - begin);
  const int x = centred(at % width_px_, width_px_), y = centred(at / width_px_, height_px_);
  float (*fraction)(float, float, float) WASP_REALTIME = nullptr;
  if (method == ShiftMethod::kCrossCorrelationSubpixel) fraction = &parabola;
  if (method == ShiftMethod::kForoosh) fraction = &side_peak;
  out.x_px = static_cast<float>(x);
  out.y_px = static_cast<float>(y);
  if (fraction == nullptr) return;
  out.x_px += fraction(surface(x - 1, y), surface(x, y), surface(x + 1, y));
  out.y_px += fraction(surface(x, y - 1), surface(x, y), surface(x, y + 1));
}

/// Sum of |F|^2 over the whole spectrum.
double ShiftReference::energy(const std::vector<Complex>& spectrum) const noexcept {
  const int half = width_px_ / 2 + 1;
  double sum = 0;
  for (int v = 0; v < height_px_; ++v)
    for (int u = 0; u < half; ++u) {
      const bool twice = u > 0 && (u < half - 1 || width_px_ % 2 == 1);
      sum += (twice ? 2.0 : 1.0) * static_cast<double>(std::norm(spectrum[size(v) * size(half) + size(u)]));
    }
  return sum;
}

ImageShift ShiftReference::estimate(ShiftMethod method, const GrayView& first, const GrayView& second) noexcept {
  ImageShift out;
  for (const GrayView* view : {&first, &second})
    if (!view->valid() || view->width_px != width_px_ || view->height_px != height_px_) return out;
  transform(first, first_);
  transform(second, second_);
  for (std::size_t i = 0; i < spectrum_size(); ++i) product_[i] = second_[i] * std::conj(first_[i]);
  const double product = energy(first_) * energy(second_);
  if (!(product > 0.0)) return out;
  if (method == ShiftMethod::kShearAverage) {
    shear_average(out);
  } else {
    correlate(method == ShiftMethod::kKuglinHines || method == ShiftMethod::kForoosh);
    find_peak(method, out);
  }
  correlate(false);
  const int x = static_cast<int>(std::lround(out.x_px)), y = static_cast<int>(std::lround(out.y_px));
  out.coefficient = static_cast<float>(static_cast<double>(surface(x, y)) / std::sqrt(product));
  out.quality = std::clamp(out.coefficient, 0.f, 1.f);
  out.valid = true;
  return out;
}

}  // namespace wasp::vision
