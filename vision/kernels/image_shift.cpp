#include "vision/kernels/image_shift.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace wasp::vision {
namespace {

constexpr int kFineSide = 128;  ///< windows are binned until no side is longer [bins]
constexpr int kMargin = shift::kLanesMargin;
constexpr int kFineSteps = 5, kCoarseSteps = 3;
constexpr float kNoiseFloor = 3.f;  ///< bins below this many times the mean of the highest ones count as noise
constexpr float kNearEnough_bins = 2e-4f;

std::size_t size(int a, int b = 1) { return static_cast<std::size_t>(a) * static_cast<std::size_t>(b); }
int padded(int n) { return (n + kMargin - 1) / kMargin * kMargin + kMargin; }
int nearest(float x) { return static_cast<int>(std::lround(x)); }

/// Hann windows of every length, one a row.
std::vector<float> hann_windows(int longest, int pitch) {
  std::vector<float> windows(size(longest + 1, pitch), 0.f);
  for (int n = 1; n <= longest; ++n)
    for (int i = 0; i < n; ++i)
      windows[size(n, pitch) + size(i)] =
          static_cast<float>(0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (i + 0.5) / n));
  return windows;
}

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

ImageShiftPlan::ImageShiftPlan(int width_px, int height_px, const ImageShiftParams& params)
    : width_px_(width_px), height_px_(height_px), params_(params) {
  if (std::min(width_px, height_px) < kMinShiftSide || std::max(width_px, height_px) > kMaxShiftSide)
    throw std::invalid_argument("image_shift: window side outside 32 ... 512 px");
  const int longest = std::max(width_px, height_px), shortest = std::min(width_px, height_px);
  int bin = 1;
  while (longest / bin > kFineSide && shortest / bin >= 32) bin *= 2;
  size_level(fine_, bin);
  size_level(coarse_, std::min(fine_.columns, fine_.rows) >= 128 ? 2 * bin : bin);
  const bool halved = std::min(coarse_.columns, coarse_.rows) >= 64;
  size_spectrum(coarse_spectrum_, coarse_, halved ? 0.24 : 0.48, coarse_.bin == 1 ? 0.2 : 0.12);
  size_spectrum(fine_spectrum_, fine_, 0.4, static_cast<double>(params.band));
  const int step = halved ? 2 : 1;
  surface_rows_ = coarse_spectrum_.rows / step;
  surface_columns_ = coarse_spectrum_.columns / step;
  surface_ = RealFft(surface_rows_, surface_columns_, params.planning);
  const auto range = [&](int bins, int most) {
    return std::clamp(static_cast<int>(params.max_shift * static_cast<float>(bins / step)), 1, most / 2 - 1);
  };
  search_ = {range(coarse_.columns, surface_columns_), range(coarse_.rows, surface_rows_)};
  row_peak_.assign(size(2 * search_.y + 1), 0.f);
  const int side = std::max(fine_spectrum_.rows, fine_spectrum_.columns);
  window_pitch_ = padded(side);
  windows_ = hann_windows(side, window_pitch_);
  for (auto* phasors : {&ex_re_, &ex_im_, &ey_re_, &ey_im_}) phasors->assign(size(padded(side)), 0.f);
}

void ImageShiftPlan::size_level(Level& level, int bin) const {
  level.bin = bin;
  level.columns = width_px_ / bin;
  level.rows = height_px_ / bin;
  level.pitch = padded(level.columns + kMargin);
  for (auto* image : {&level.first, &level.second})
    image->assign(size(level.rows, level.pitch) + 2 * size(level.pitch), 0.f);
}

void ImageShiftPlan::size_spectrum(Spectrum& s, const Level& level, double band, double sigma) const {
  s.rows = good_fft_size(level.rows);
  s.columns = good_fft_size(level.columns);
  s.fft = ComplexFft(s.rows, s.columns, params_.planning);
  const int v_most = std::min(static_cast<int>(band * s.rows), s.rows / 2 - 1);
  const int u_most = std::min(static_cast<int>(band * s.columns), s.columns / 2 - 1);
  const int pitch = padded(u_most + 1);
  for (auto* plane : {&s.h_re, &s.h_im, &s.g_re, &s.g_im})
    plane->assign(size(2 * v_most + 1, pitch) + size(kMargin), 0.f);
  s.h = {s.h_re.data(), s.h_im.data(), v_most, u_most, pitch};
  s.g = {s.g_re.data(), s.g_im.data(), v_most, u_most, pitch};
  const auto gauss = [sigma](int k, int n) {
    const double f = static_cast<double>(k) / n / sigma;
    return static_cast<float>(std::exp(-0.5 * f * f));
  };
  s.weight_x.assign(size(pitch), 0.f);
  for (int u = 0; u <= u_most; ++u) s.weight_x[size(u)] = (u == 0 ? 0.5f : 1.f) * gauss(u, s.columns);
  s.weight_y.assign(size(2 * v_most + 1), 0.f);
  for (int v = -v_most; v <= v_most; ++v) s.weight_y[size(v + v_most)] = gauss(v, s.rows);
}

void ImageShiftPlan::pack(const Spectrum& s, const float* first, const float* second, int pitch, int rows,
                          int columns) noexcept {
  const float *wx = window(columns), *wy = window(rows);
  const float scale = 1.f / (sum_of(wx, columns) * sum_of(wy, rows));
  const float mean_first = scale * shift::weighted_sum(first, pitch, rows, columns, wx, wy);
  const float mean_second = scale * shift::weighted_sum(second, pitch, rows, columns, wx, wy);
  shift::pack_pair(first, second, pitch, rows, columns, mean_first, mean_second, wx, wy, s.fft.data(), s.rows,
                   s.columns);
}

/// Phase correlation of the coarse images, as a surface over whole-bin shifts.
void ImageShiftPlan::correlate_coarse() noexcept {
  Spectrum& s = coarse_spectrum_;
  pack(s, coarse_.first.data(), coarse_.second.data(), coarse_.pitch, coarse_.rows, coarse_.columns);
  s.fft.execute();
  shift::cross_power(s.fft.data(), s.rows, s.columns, s.h);
  shift::whiten(s.h, 0.f, s.weight_x.data(), s.weight_y.data(), s.g);
  const int half = surface_columns_ / 2 + 1;
  for (int row = 0; row < surface_rows_; ++row) {
    const int v = row <= surface_rows_ / 2 ? row : row - surface_rows_;
    std::complex<float>* out = surface_.spectrum() + static_cast<std::ptrdiff_t>(row) * half;
    std::fill(out, out + half, std::complex<float>{});
    if (std::abs(v) > s.g.rows_v) continue;
    const float *re = s.g.re + s.g.offset(v), *im = s.g.im + s.g.offset(v);
    for (int u = 0; u <= s.g.columns_u; ++u) out[u] = {re[u], im[u]};
    out[0] *= 2.f;  // the half weight of column 0 is for sums over half planes
  }
  surface_.inverse();
}

/// Coefficient (3.15) of what the coarse images share at a whole-bin shift.
float ImageShiftPlan::overlap_coefficient(int x, int y) const noexcept {
  const int columns = coarse_.columns - std::abs(x), rows = coarse_.rows - std::abs(y);
  const int ax = std::max(0, -x), ay = std::max(0, -y), bx = std::max(0, x), by = std::max(0, y);
  const auto sums = shift::overlap_sums(coarse_.first.data() + ay * coarse_.pitch + ax,
                                        coarse_.second.data() + by * coarse_.pitch + bx, coarse_.pitch, rows, columns);
  const float n = static_cast<float>(rows * columns);
  const float vaa = sums.aa - sums.a * sums.a / n, vbb = sums.bb - sums.b * sums.b / n;
  const float vab = sums.ab - sums.a * sums.b / n;
  const float product = vaa * vbb;
  return product > 0.f ? vab / std::sqrt(product) : 0.f;
}

/// Highest point of the surface that is left, within the search range.
ImageShiftPlan::Peak ImageShiftPlan::highest() const noexcept {
  Peak peak;
  for (int v = -search_.y; v <= search_.y; ++v)
    if (row_peak_[size(v + search_.y)] > peak.value) peak = {0, v, row_peak_[size(v + search_.y)]};
  for (int u = -search_.x; u <= search_.x; ++u)
    if (surface_at(u, peak.y) >= peak.value) peak.x = u;
  return peak;
}

void ImageShiftPlan::measure_row(int v) noexcept {
  const float* row = &surface_at(0, v);
  const float right = shift::max_of(row, search_.x + 1);
  row_peak_[size(v + search_.y)] = std::max(right, shift::max_of(row + surface_columns_ - search_.x, search_.x));
}

/// Takes a peak and its neighbours out of the surface.
void ImageShiftPlan::remove(const Peak& peak) noexcept {
  for (int v = peak.y - 1; v <= peak.y + 1; ++v) {
    if (std::abs(v) > search_.y) continue;
    for (int u = peak.x - 1; u <= peak.x + 1; ++u)
      if (std::abs(u) <= search_.x) surface_at(u, v) = -1e30f;
    measure_row(v);
  }
}

/// Parabola through the peak and its neighbours, each axis; in coarse bins.
ImageShiftPlan::Offset ImageShiftPlan::vertex(const Peak& peak) const noexcept {
  const auto top = [](float low, float mid, float high) {
    const float bend = low - 2.f * mid + high;
    return low > -1e29f && high > -1e29f && bend < 0.f ? std::clamp(0.5f * (low - high) / bend, -0.5f, 0.5f) : 0.f;
  };
  const int u = peak.x, v = peak.y;
  const float step = static_cast<float>(coarse_spectrum_.columns) / static_cast<float>(surface_columns_);
  return {step * (static_cast<float>(u) + top(surface_at(u - 1, v), peak.value, surface_at(u + 1, v))),
          step * (static_cast<float>(v) + top(surface_at(u, v - 1), peak.value, surface_at(u, v + 1)))};
}

/// Of the few highest peaks the one that is both high and agrees where the images overlap; in coarse bins.
bool ImageShiftPlan::coarse_shift(Offset& found) noexcept {
  correlate_coarse();
  for (int v = -search_.y; v <= search_.y; ++v) measure_row(v);
  float best = 0.f, top = 0.f;
  for (int k = 0; k < kCandidates; ++k) {
    const Peak peak = highest();
    if (!(peak.value > 0.f)) break;
    top = std::max(top, peak.value);
    const Offset at = vertex(peak);
    const float share = (1.f - std::abs(at.x) / static_cast<float>(coarse_.columns)) *
                        (1.f - std::abs(at.y) / static_cast<float>(coarse_.rows));  // little overlap agrees by chance
    const float score = overlap_coefficient(nearest(at.x), nearest(at.y)) * share * peak.value / top;
    if (score > best) best = score, found = at;
    remove(peak);
  }
  if (!(best > 0.f)) return false;
  shift::PeakSums sums;
  Offset at = found;
  if (climb(coarse_spectrum_, at, sums, kCoarseSteps) && std::hypot(at.x - found.x, at.y - found.y) < 1.5f) found = at;
  return true;
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
  const float* shifted = fine_.second.data();
  if (bin == 1)
    shifted += (ay + dy) * fine_.pitch + ax + dx;
  else
    shift::bin_image(second, ax * bin + dx, ay * bin + dy, bin, rows, columns, fine_.second.data(), fine_.pitch);
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

ImageShift ImageShiftPlan::estimate(const GrayView& first, const GrayView& second) noexcept {
  ImageShift out;
  for (const GrayView* view : {&first, &second})
    if (!view->valid() || view->width_px != width_px_ || view->height_px != height_px_) return out;
  shift::bin_image(first, 0, 0, fine_.bin, fine_.rows, fine_.columns, fine_.first.data(), fine_.pitch);
  shift::bin_image(second, 0, 0, fine_.bin, fine_.rows, fine_.columns, fine_.second.data(), fine_.pitch);
  if (coarse_.bin != fine_.bin) {
    shift::halve_image(fine_.first.data(), fine_.pitch, coarse_.rows, coarse_.columns, coarse_.first.data(),
                       coarse_.pitch);
    shift::halve_image(fine_.second.data(), fine_.pitch, coarse_.rows, coarse_.columns, coarse_.second.data(),
                       coarse_.pitch);
  } else {
    std::copy(fine_.first.begin(), fine_.first.end(), coarse_.first.begin());
    std::copy(fine_.second.begin(), fine_.second.end(), coarse_.second.begin());
  }
  Offset coarse;
  if (!coarse_shift(coarse)) return out;
  const float scale = static_cast<float>(coarse_.bin);
  Offset start{scale * coarse.x, scale * coarse.y}, found;
  if (!fine_shift(second, start, found, out)) return {};
  if (std::hypot(found.x - std::round(start.x), found.y - std::round(start.y)) > 0.8f) {
    // cut where the content really is
    start = found;
    if (!fine_shift(second, start, found, out)) return {};
  }
  out.x_px = found.x;
  out.y_px = found.y;
  const float stray = std::hypot(found.x - start.x, found.y - start.y);
  out.valid = out.quality >= out.least_quality && stray < 2.f * static_cast<float>(coarse_.bin);
  return out;
}

}  // namespace wasp::vision
