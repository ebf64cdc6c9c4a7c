#include "vision/kernels/image_shift_projections.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>

namespace wasp::vision {
namespace {

constexpr int kBandRows = 128;   ///< rows whose pixels' sum still fits 16 bits
constexpr int kLeastShared = 8;  ///< sums in common

std::size_t size(int n) { return static_cast<std::size_t>(n); }

/// Distance of a parabola's vertex from the middle of three samples.
float vertex(float low, float mid, float high) noexcept {
  const float bend = low - 2.f * mid + high;
  return bend < 0.f ? std::clamp(0.5f * (low - high) / bend, -0.5f, 0.5f) : 0.f;
}

/// energy[i]: sum of the first i squares.
void add_up(const std::vector<float>& values, int count, std::vector<float>& energy) noexcept {
  float sum = 0;
  energy[0] = 0;
  for (int i = 0; i < count; ++i) {
    sum += values[size(i)] * values[size(i)];
    energy[size(i + 1)] = sum;
  }
}

std::uint32_t row_sum(const std::uint8_t* pixels, int count) noexcept {
  std::uint32_t sum = 0;
  for (int u = 0; u < count; ++u) sum += pixels[u];
  return sum;
}

}  // namespace

ShiftProjections::ShiftProjections(int width_px, int height_px, const ShiftProjectionsParams& params)
    : width_px_(width_px), height_px_(height_px), params_(params) {
  if (std::min(width_px, height_px) < kMinShiftSide || std::max(width_px, height_px) > kMaxShiftSide)
    throw std::invalid_argument("image_shift projections: window side outside 32 ... 512 px");
  size_axis(across_, width_px);
  size_axis(down_, height_px);
  band_.assign(size(width_px), 0);
  columns_.assign(size(width_px), 0);
}

void ShiftProjections::size_axis(Axis& axis, int side) const {
  axis.count = side - 1;
  axis.most = std::clamp(static_cast<int>(params_.max_shift * static_cast<float>(side)), 1, axis.count - kLeastShared);
  axis.padded = good_fft_size(2 * side);
  axis.fft = RealFft(1, axis.padded, params_.planning);
  axis.spectrum.resize(size(axis.padded / 2 + 1));
  for (auto* values : {&axis.first, &axis.second}) values->assign(size(side), 0.f);
  for (auto* values : {&axis.energy_first, &axis.energy_second}) values->assign(size(side + 1), 0.f);
}

/// Differences of neighbouring column sums (across) and row sums (down) of a part of the image: whiter than the sums,
/// and blind to brightness.
void ShiftProjections::project(const GrayView& image, int x, int y, int columns, int rows, std::vector<float>& across,
                               std::vector<float>& down) noexcept {
  std::fill(columns_.begin(), columns_.end(), 0u);
  std::uint32_t before = 0;
  for (int start = 0; start < rows; start += kBandRows) {
    std::fill(band_.begin(), band_.end(), std::uint16_t{0});
    for (int r = start; r < std::min(rows, start + kBandRows); ++r) {
      const std::uint8_t* pixels = image.row(y + r) + x;
      for (int c = 0; c < columns; ++c) band_[size(c)] = static_cast<std::uint16_t>(band_[size(c)] + pixels[c]);
      const std::uint32_t sum = row_sum(pixels, columns);
      if (r > 0) down[size(r - 1)] = static_cast<float>(sum) - static_cast<float>(before);
      before = sum;
    }
    for (int c = 0; c < columns; ++c) columns_[size(c)] += band_[size(c)];
  }
  for (int c = 0; c + 1 < columns; ++c)
    across[size(c)] = static_cast<float>(columns_[size(c + 1)]) - static_cast<float>(columns_[size(c)]);
}

void ShiftProjections::transform(const Axis& axis, const std::vector<float>& values) noexcept {
  float* padded = axis.fft.real();
  std::fill(std::copy(values.begin(), values.begin() + axis.count, padded), padded + axis.padded, 0.f);
  axis.fft.forward();
}

/// Whole pixels: the highest normalised correlation of all lags.
ShiftProjections::Match ShiftProjections::search(Axis& axis) noexcept {
  const int n = axis.padded, count = axis.count;
  transform(axis, axis.first);
  std::complex<float>* z = axis.fft.spectrum();
  std::copy(z, z + n / 2 + 1, axis.spectrum.begin());
  transform(axis, axis.second);
  for (int k = 0; k <= n / 2; ++k) {  // F2 conj(F1)
    const std::complex<float> f1 = axis.spectrum[size(k)], f2 = z[k];
    z[k] = {f2.real() * f1.real() + f2.imag() * f1.imag(), f2.imag() * f1.real() - f2.real() * f1.imag()};
  }
  axis.fft.inverse();
  const float* correlations = axis.fft.real();
  add_up(axis.first, count, axis.energy_first);
  add_up(axis.second, count, axis.energy_second);
  Match best;
  for (int lag = -axis.most; lag <= axis.most; ++lag) {
    const int a = std::max(0, -lag), b = std::max(0, lag), shared = count - std::abs(lag);
    const float ea = axis.energy_first[size(a + shared)] - axis.energy_first[size(a)];
    const float eb = axis.energy_second[size(b + shared)] - axis.energy_second[size(b)];
    const float product = ea * eb;
    if (!(product > 0.f)) continue;
    const float correlation = correlations[lag < 0 ? lag + n : lag] / static_cast<float>(n) / std::sqrt(product);
    const float share = static_cast<float>(shared) / static_cast<float>(count);  // little overlap agrees by chance
    if (share * correlation > best.coefficient) best = {static_cast<float>(lag), share * correlation};
  }
  return best;
}

/// Normalised correlation of the first `count` differences at a lag.
float ShiftProjections::coefficient(const Axis& axis, int count, int lag) noexcept {
  const int a = std::max(0, -lag), b = std::max(0, lag);
  float aa = 0, bb = 0, ab = 0;
  for (int i = 0; i < count - std::abs(lag); ++i) {
    const float p = axis.first[size(a + i)], q = axis.second[size(b + i)];
    aa += p * p, bb += q * q, ab += p * q;
  }
  const float product = aa * bb;
  return product > 0.f ? ab / std::sqrt(product) : 0.f;
}

/// The fraction left after both windows were cut to what they share.
ShiftProjections::Match ShiftProjections::refine(const Axis& axis, int count) noexcept {
  const float low = coefficient(axis, count, -1), mid = coefficient(axis, count, 0), high = coefficient(axis, count, 1);
  return {vertex(low, mid, high), mid};
}

ImageShift ShiftProjections::estimate(const GrayView& first, const GrayView& second) noexcept {
  for (const GrayView* view : {&first, &second})
    if (!view->valid() || view->width_px != width_px_ || view->height_px != height_px_) return {};
  project(first, 0, 0, width_px_, height_px_, across_.first, down_.first);
  project(second, 0, 0, width_px_, height_px_, across_.second, down_.second);
  const Match x = search(across_), y = search(down_);
  if (!(x.coefficient > 0.f) || !(y.coefficient > 0.f)) return {};
  const int dx = static_cast<int>(x.shift_px), dy = static_cast<int>(y.shift_px);
  const int columns = width_px_ - std::abs(dx), rows = height_px_ - std::abs(dy);
  project(first, std::max(0, -dx), std::max(0, -dy), columns, rows, across_.first, down_.first);
  project(second, std::max(0, dx), std::max(0, dy), columns, rows, across_.second, down_.second);
  const Match fx = refine(across_, columns - 1), fy = refine(down_, rows - 1);
  ImageShift out;
  out.x_px = x.shift_px + fx.shift_px;
  out.y_px = y.shift_px + fy.shift_px;
  out.coefficient = std::min(fx.coefficient, fy.coefficient);
  out.quality = std::max(0.f, out.coefficient);
  // Chance: coefficients of n differences scatter by 1 / sqrt(n); the best of hundreds of lags lies 3 of these out.
  out.least_quality = std::max(params_.least_coefficient, 4.f / std::sqrt(static_cast<float>(std::min(columns, rows))));
  out.valid = out.quality >= out.least_quality;
  return out;
}

}  // namespace wasp::vision
