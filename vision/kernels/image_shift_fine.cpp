// A fraction of a bin: both windows cut to what they share, then Newton's method on the correlation peak evaluated from
// the spectrum.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "vision/kernels/image_shift.h"

namespace wasp::vision {
namespace {

constexpr int kFineSteps = 5;
constexpr float kNoiseFloor = 3.f;  ///< bins below this many times the mean of the highest ones count as noise
constexpr float kNearEnough_bins = 2e-4f;

int nearest(float x) { return static_cast<int>(std::lround(x)); }

/// Quality that unrelated images do not reach. Their phases are uniform, so the quality of one shift is Gaussian with
/// deviation 1 / sqrt(2 n), n independent bins: 2 pi sigma^2 a pixel under the Gaussian band limit, over 1.5^2 for the
/// Hann window, over 4 because weights go as |H|^2 there. The best of thousands of shifts lies 4 deviations out; 6
/// leave a margin.
float chance_quality(int columns, int rows, float sigma) noexcept {
  const float bins =
      2.f * std::numbers::pi_v<float> * sigma * sigma * static_cast<float>(columns * rows) / (2.25f * 4.f);
  return 6.f / std::sqrt(2.f * bins);
}

float sum_of(const float* values, int count) noexcept {
  float sum = 0;
  for (int i = 0; i < count; ++i) sum += values[i];
  return sum;
}

}  // namespace

void ImageShiftPlan::pack(const Spectrum& s, const float* first, const float* second, int pitch, int rows,
                          int columns) noexcept {
  const float *wx = window(columns), *wy = window(rows);
  const float scale = 1.f / (sum_of(wx, columns) * sum_of(wy, rows));
  const float mean_first = scale * shift::weighted_sum(first, pitch, rows, columns, wx, wy);
  const float mean_second = scale * shift::weighted_sum(second, pitch, rows, columns, wx, wy);
  shift::pack_pair(first, second, pitch, rows, columns, mean_first, mean_second, wx, wy, s.fft.data(), s.rows,
                   s.columns);
}

void ImageShiftPlan::set_phasors(const Spectrum& s, Offset at) noexcept {
  const auto fill = [](float* re, float* im, int from, int to, double step) {
    // Two at a time from both ends would save little: a hundred complex products.
    const double c = std::cos(step), sn = std::sin(step);
    double x = std::cos(from * step), y = std::sin(from * step);
    for (int k = from; k <= to; ++k) {
      *re++ = static_cast<float>(x);
      *im++ = static_cast<float>(y);
      const double next = x * c - y * sn;
      y = x * sn + y * c;
      x = next;
    }
  };
  const double turn = 2.0 * std::numbers::pi;
  fill(ex_re_.data(), ex_im_.data(), 0, s.g.columns_u, turn * static_cast<double>(at.x) / s.columns);
  fill(ey_re_.data(), ey_im_.data(), -s.g.rows_v, s.g.rows_v, turn * static_cast<double>(at.y) / s.rows);
}

/// Newton's method from `at` (fine bins) to the top of the correlation peak.
bool ImageShiftPlan::climb(const Spectrum& s, Offset& at, shift::PeakSums& peak, int steps) noexcept {
  const float bins_x = static_cast<float>(s.columns / (2.0 * std::numbers::pi));
  const float bins_y = static_cast<float>(s.rows / (2.0 * std::numbers::pi));
  for (int step = 0; step < steps; ++step) {
    set_phasors(s, at);
    peak = shift::peak_sums(s.g, ex_re_.data(), ex_im_.data(), ey_re_.data(), ey_im_.data());
    const float determinant = peak.cxx * peak.cyy - peak.cxy * peak.cxy;
    float dx, dy;
    if (peak.cxx < 0.f && determinant > 0.02f * peak.cxx * peak.cyy) {
      dx = -(peak.cyy * peak.cx - peak.cxy * peak.cy) / determinant * bins_x;
      dy = -(peak.cxx * peak.cy - peak.cxy * peak.cx) / determinant * bins_y;
    } else {
      const float slope = std::hypot(peak.cx, peak.cy);
      if (!(slope > 0.f)) return false;
      dx = 0.5f * peak.cx / slope;
      dy = 0.5f * peak.cy / slope;
    }
    const float length = std::hypot(dx, dy);
    if (!(length < 1e6f)) return false;
    const float scale = length > 0.75f ? 0.75f / length : 1.f;
    at.x += scale * dx;
    at.y += scale * dy;
    if (length < kNearEnough_bins) return true;
  }
  return true;
}

/// Cuts both windows to what they share at `start` (pixels) and climbs. `found` in pixels.
bool ImageShiftPlan::fine_shift(const GrayView& second, Offset start, Offset& found, ImageShift& out) noexcept {
  const int bin = fine_.bin;
  const int dx = nearest(start.x), dy = nearest(start.y);
  // The first window's bins stay; the second's are summed anew from its shifted origin.
  const int ax = (std::max(0, -dx) + bin - 1) / bin, ay = (std::max(0, -dy) + bin - 1) / bin;
  const int columns = std::min(fine_.columns - ax, (width_px_ - (ax * bin + dx)) / bin);
  const int rows = std::min(fine_.rows - ay, (height_px_ - (ay * bin + dy)) / bin);
  if (columns < 8 || rows < 8) return false;
  Spectrum& s = fine_spectrum_;
  const float* first = fine_.first.data() + ay * fine_.pitch + ax;
  const float* shifted = fine_.second.data() + (ay + dy) * fine_.pitch + ax + dx;
  if (bin > 1) {
    shift::bin_image(second, ax * bin + dx, ay * bin + dy, bin, rows, columns, recut_.data(), fine_.pitch);
    shifted = recut_.data();
  }
  pack(s, first, shifted, fine_.pitch, rows, columns);
  s.fft.execute();
  const auto energy = shift::cross_power(s.fft.data(), s.rows, s.columns, s.h);
  const float noise = kNoiseFloor * shift::mean_magnitude(s.h, s.h.columns_u * 3 / 4);
  const float whole = shift::whiten(s.h, noise, s.weight_x.data(), s.weight_y.data(), s.g);
  out.least_quality = std::max(params_.min_quality, chance_quality(columns, rows, params_.band));
  const double product = energy.first * energy.second;
  if (!(whole > 0.f) || !(product > 0.0)) return false;
  const float scale = static_cast<float>(bin);
  Offset at{(start.x - static_cast<float>(dx)) / scale, (start.y - static_cast<float>(dy)) / scale};
  shift::PeakSums peak;
  if (!climb(s, at, peak, kFineSteps)) return false;
  const auto plain = shift::peak_sums(s.h, ex_re_.data(), ex_im_.data(), ey_re_.data(), ey_im_.data());
  out.coefficient = static_cast<float>(static_cast<double>(plain.c) / std::sqrt(product));
  out.quality = std::clamp(peak.c / whole, 0.f, 1.f);
  found = {static_cast<float>(dx) + scale * at.x, static_cast<float>(dy) + scale * at.y};
  return true;
}

}  // namespace wasp::vision
