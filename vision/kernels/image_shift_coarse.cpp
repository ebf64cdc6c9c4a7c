// Whole bins: the highest peaks of the phase correlation of the coarse images, told apart by how well the images agree
// where they overlap.

#include <algorithm>
#include <cmath>

#include "vision/kernels/image_shift.h"

namespace wasp::vision {
namespace {

constexpr int kCoarseSteps = 3;
constexpr float kLeastDifference = 0.01f;  ///< 1 - r^2: images that agree better than this agree as well as can be told
constexpr float kElsewhere_bins = 3.f;     ///< a peak farther from the one taken is another answer

std::size_t size(int a) { return static_cast<std::size_t>(a); }
int nearest(float x) { return static_cast<int>(std::lround(x)); }

}  // namespace

/// Phase correlation of the coarse images, as a surface over whole-bin shifts.
void ImageShiftPlan::correlate_coarse() noexcept {
  Spectrum& s = coarse_spectrum_;
  const Level& level = coarse();
  pack(s, level.first.data(), level.second.data(), level.pitch, level.rows, level.columns);
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

/// What the coarse images share at a shift, to the nearest bin: means, and mean squares and product about them.
shift::OverlapSums ImageShiftPlan::overlap(Offset at) const noexcept {
  const Level& level = coarse();
  const int x = nearest(at.x), y = nearest(at.y);
  const int columns = level.columns - std::abs(x), rows = level.rows - std::abs(y);
  const int ax = std::max(0, -x), ay = std::max(0, -y), bx = std::max(0, x), by = std::max(0, y);
  const auto s = shift::overlap_sums(level.first.data() + ay * level.pitch + ax,
                                     level.second.data() + by * level.pitch + bx, level.pitch, rows, columns);
  const float n = static_cast<float>(rows * columns), a = s.a / n, b = s.b / n;
  return {a, b, s.aa / n - a * a, s.bb / n - b * b, s.ab / n - a * b};
}

/// How much a shift's overlap speaks for it: n pixels in common with coefficient r (3.15) are (1 - r^2)^(-n/2) times as
/// likely with the same picture in both as with different ones. The logarithm of that, a pixel of the window, times the
/// share in common once more: small motions are likelier than large ones, and little overlap agrees by chance.
float ImageShiftPlan::likelihood(Offset at) const noexcept {
  const auto s = overlap(at);
  const float product = s.aa * s.bb;
  if (!(product > 0.f) || !(s.ab > 0.f)) return 0.f;
  const float share = (1.f - std::abs(at.x) / static_cast<float>(coarse().columns)) *
                      (1.f - std::abs(at.y) / static_cast<float>(coarse().rows));
  return share * share * -std::log(std::max(1.f - s.ab * s.ab / product, kLeastDifference));
}

shift::ImagePair ImageShiftPlan::coarse_pair(Offset at) const noexcept {
  const Level& level = coarse();
  const auto s = overlap(at);
  shift::ImagePair pair{level.first.data(), level.second.data(), level.pitch, level.rows, level.columns};
  if (s.bb > 0.f && s.aa > 0.f) pair.gain = std::sqrt(s.aa / s.bb);
  pair.offset = s.a - pair.gain * s.b;
  return pair;
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

/// Of the highest peaks the one whose height times likelihood is greatest; in coarse bins. Peaks too low to win,
/// however well they agreed, are not looked at.
bool ImageShiftPlan::coarse_shift(Offset& found, ImageShift& out) noexcept {
  correlate_coarse();
  for (int v = -search_.y; v <= search_.y; ++v) measure_row(v);
  const float most = -std::log(kLeastDifference);
  float best = 0.f, rival = 0.f, top = 0.f;
  for (; out.candidates < kCandidates; ++out.candidates) {
    const Peak peak = highest();
    top = std::max(top, peak.value);
    if (!(peak.value > 0.f) || peak.value * most < best * top) break;
    const Offset at = vertex(peak);
    const float score = likelihood(at) * peak.value / top;
    const bool elsewhere = std::hypot(at.x - found.x, at.y - found.y) > kElsewhere_bins;
    if (score > best) {
      if (elsewhere) rival = best;
      best = score, found = at;
    } else if (elsewhere) {
      rival = std::max(rival, score);
    }
    remove(peak);
  }
  if (!(best > 0.f)) return false;
  out.rival = rival / best;
  shift::PeakSums sums;
  Offset at = found;
  if (climb(coarse_spectrum_, at, sums, kCoarseSteps) && std::hypot(at.x - found.x, at.y - found.y) < 1.5f) found = at;
  return true;
}

}  // namespace wasp::vision
