#include "vision/kernels/image_shift.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace wasp::vision {
namespace {

constexpr int kFineSide = 128;             ///< windows are binned until no side is longer [bins]
constexpr float kLeastError_bins = 0.05f;  ///< what binned images can resolve under a changing motion
constexpr int kMargin = shift::kLanesMargin;

std::size_t size(int a, int b = 1) { return static_cast<std::size_t>(a) * static_cast<std::size_t>(b); }
int padded(int n) { return (n + kMargin - 1) / kMargin * kMargin + kMargin; }

/// Hann windows of every length, one a row.
std::vector<float> hann_windows(int longest, int pitch) {
  std::vector<float> windows(size(longest + 1, pitch), 0.f);
  for (int n = 1; n <= longest; ++n)
    for (int i = 0; i < n; ++i)
      windows[size(n, pitch) + size(i)] =
          static_cast<float>(0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (i + 0.5) / n));
  return windows;
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
  if (bin > 1) recut_ = fine_.second;
  if (std::min(fine_.columns, fine_.rows) >= 128) size_level(halved_, 2 * bin);
  const bool halved = std::min(coarse().columns, coarse().rows) >= 64;
  size_spectrum(coarse_spectrum_, coarse(), halved ? 0.24 : 0.48, coarse().bin == 1 ? 0.2 : 0.12);
  size_spectrum(fine_spectrum_, fine_, 0.4, static_cast<double>(params.band));
  const int step = halved ? 2 : 1;
  surface_rows_ = coarse_spectrum_.rows / step;
  surface_columns_ = coarse_spectrum_.columns / step;
  surface_ = RealFft(surface_rows_, surface_columns_, params.planning);
  const auto range = [&](int bins, int most) {
    return std::clamp(static_cast<int>(params.max_shift * static_cast<float>(bins / step)), 1, most / 2 - 1);
  };
  search_ = {range(coarse().columns, surface_columns_), range(coarse().rows, surface_rows_)};
  row_peak_.assign(size(2 * search_.y + 1), 0.f);
  const int side = std::max(fine_spectrum_.rows, fine_spectrum_.columns);
  window_pitch_ = padded(side);
  windows_ = hann_windows(side, window_pitch_);
  check_weights_.assign(size(2, window_pitch_), 0.f);
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

void ImageShiftPlan::bin_both(const GrayView& first, const GrayView& second) noexcept {
  shift::bin_image(first, 0, 0, fine_.bin, fine_.rows, fine_.columns, fine_.first.data(), fine_.pitch);
  shift::bin_image(second, 0, 0, fine_.bin, fine_.rows, fine_.columns, fine_.second.data(), fine_.pitch);
  if (halved_.columns == 0) return;
  const Level& h = halved_;
  shift::halve_image(fine_.first.data(), fine_.pitch, h.rows, h.columns, halved_.first.data(), h.pitch);
  shift::halve_image(fine_.second.data(), fine_.pitch, h.rows, h.columns, halved_.second.data(), h.pitch);
}

/// Coarse, then fine; where the first cut was more than a bin off, cut where the content really is. Pixels.
bool ImageShiftPlan::measure(const GrayView& second, Offset& found, ImageShift& out) noexcept {
  Offset coarse_bins;
  if (!coarse_shift(coarse_bins, out)) return false;
  const float scale = static_cast<float>(coarse().bin);
  Offset start{scale * coarse_bins.x, scale * coarse_bins.y};
  if (!fine_shift(second, start, found, out)) return false;
  if (std::hypot(found.x - std::round(start.x), found.y - std::round(start.y)) > static_cast<float>(fine_.bin)) {
    start = found;
    if (!fine_shift(second, start, found, out)) return false;
  }
  return std::hypot(found.x - start.x, found.y - start.y) < 2.f * scale;
}

/// Takes the motion of the middle from the affine fit where it is another than `found` (pixels), and decides.
void ImageShiftPlan::check(Offset found, ImageShift& out) noexcept {
  const float bin = static_cast<float>(coarse().bin);
  const auto pair = coarse_pair({found.x / bin, found.y / bin});
  const shift::CheckParams limits{.most_error = std::max(params_.most_error_px / bin, kLeastError_bins)};
  const auto fit = shift::check_shift(pair, found.x / bin, found.y / bin, limits, windows_.data(), window_pitch_,
                                      check_weights_.data());
  out.fits = fit.fits;
  out.texture = fit.texture;
  out.error_px = bin * fit.error;
  out.warped = fit.good && fit.corrected;
  out.x_px = out.warped ? bin * fit.motion.dx : found.x;
  out.y_px = out.warped ? bin * fit.motion.dy : found.y;
  out.valid = fit.good && out.quality >= out.least_quality && out.rival <= params_.most_rival;
}

ImageShift ImageShiftPlan::estimate(const GrayView& first, const GrayView& second) noexcept {
  for (const GrayView* view : {&first, &second})
    if (!view->valid() || view->width_px != width_px_ || view->height_px != height_px_) return {};
  bin_both(first, second);
  ImageShift out;
  Offset found;
  if (!measure(second, found, out)) {
    out.x_px = found.x, out.y_px = found.y;
    return out;
  }
  check(found, out);
  return out;
}

}  // namespace wasp::vision
