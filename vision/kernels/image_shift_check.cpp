#include "vision/kernels/image_shift_check.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace wasp::vision::shift {
namespace {

constexpr int kLeastRegion = 12;      ///< bins either way
constexpr float kMostMotion = 4.f;    ///< bins at the edge: beyond, the fit may have followed something else
constexpr float kMostShare = 0.6f;    ///< the middle's correction over the motion at the edge that explains it
constexpr float kWorthwhile = 0.95f;  ///< a first fit that leaves more of the difference than this is given up
constexpr float kLongestStep = 2.f;   ///< bins

using Row = std::array<float, 9>;  ///< six coefficients, the right side, two columns of the unit matrix
using Equations = std::array<Row, 6>;

/// Normal equations of dx, dy, xx, xy, yx, yy.
Equations equations_of(const AffineSums& s) noexcept {
  const auto square = [](const std::array<float, 6>& m, std::size_t i, std::size_t j) {
    constexpr std::size_t kMoment[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};  // of {1, x, y} by {1, x, y}
    return m[kMoment[i][j]];
  };
  constexpr std::size_t kIndex[2][3] = {{0, 2, 3}, {1, 4, 5}};
  Equations n{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      n[kIndex[0][i]][kIndex[0][j]] = square(s.gxx, i, j);
      n[kIndex[0][i]][kIndex[1][j]] = n[kIndex[1][j]][kIndex[0][i]] = square(s.gxy, i, j);
      n[kIndex[1][i]][kIndex[1][j]] = square(s.gyy, i, j);
    }
    n[kIndex[0][i]][6] = -s.gxe[i];
    n[kIndex[1][i]][6] = -s.gye[i];
  }
  return n;
}

/// A Gauss-Newton step and the variance of its dx plus that of its dy, noise of variance 1.
struct Step {
  std::array<float, 6> by{};
  float variance = 0;
};

/// Gauss-Jordan; a little ridge keeps what the texture does not show at zero. False when singular.
bool solve(Equations n, Step& step) noexcept {
  n[0][7] = n[1][8] = 1.f;
  for (std::size_t i = 0; i < 6; ++i) n[i][i] *= 1.001f;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!(n[i][i] > 0.f)) return false;
    const float inverse = 1.f / n[i][i];
    for (std::size_t k = 0; k < 6; ++k) {
      if (k == i) continue;
      const float factor = n[k][i] * inverse;
      for (std::size_t j = i; j < n[k].size(); ++j) n[k][j] -= factor * n[i][j];
    }
  }
  for (std::size_t i = 0; i < 6; ++i) step.by[i] = n[i][6] / n[i][i];
  step.variance = n[0][7] / n[0][0] + n[1][8] / n[1][1];
  return true;
}

/// Energy of the gradient in its weakest direction over that of noise which explains the difference e: noise of
/// variance s makes e e = 2 s, and gx gx = s / 2.
float texture_of(const AffineSums& s) noexcept {
  const float mean = 0.5f * (s.gxx[0] + s.gyy[0]), half = 0.5f * (s.gxx[0] - s.gyy[0]);
  const float weakest = mean - std::sqrt(half * half + s.gxy[0] * s.gxy[0]);
  const float noise = 0.25f * s.ee + 1e-3f * s.weight;
  return noise > 0.f ? weakest / noise : 0.f;
}

/// What the images share at the shift, a column and row inside both whatever its fraction.
Region region_of(const ImagePair& images, float dx, float dy, const float* windows, int window_pitch,
                 float* weights) noexcept {
  const auto range = [](float d, int n, int& from, int& count) {
    const int low = static_cast<int>(std::floor(d));
    from = std::max(1, -low);
    count = std::min(n - 1, n - 1 - low) - from;
  };
  Region region;
  range(dx, images.columns, region.column, region.columns);
  range(dy, images.rows, region.row, region.rows);
  if (std::min(region.columns, region.rows) < kLeastRegion) return {};
  const float *wx = windows + region.columns * window_pitch, *wy = windows + region.rows * window_pitch;
  std::copy(wx, wx + window_pitch, weights);
  std::copy(wy, wy + window_pitch, weights + window_pitch);
  region.weight_x = weights;
  region.weight_y = weights + window_pitch;
  return region;
}

float length(float x, float y) noexcept { return std::sqrt(x * x + y * y); }

void move(Affine& m, const std::array<float, 6>& step, float scale) noexcept {
  m.dx += scale * step[0], m.dy += scale * step[1];
  m.xx += scale * step[2], m.xy += scale * step[3], m.yx += scale * step[4], m.yy += scale * step[5];
}

float edge_motion(const Affine& m) noexcept {
  return std::max({std::abs(m.xx), std::abs(m.xy), std::abs(m.yx), std::abs(m.yy)});
}

/// What the fits of one pair go through.
struct Fitting {
  float first_step = 0, first_difference = 0, step = 0, difference = 0;
  bool settled = false;
};

/// One fit: false where going on is of no use.
bool fit_once(const AffineSums& sums, const CheckParams& params, Fitting& fitting, Check& check) noexcept {
  Step step;
  ++check.fits;
  if (!(sums.weight > 0.f) || !solve(equations_of(sums), step)) return false;
  fitting.difference = sums.ee / sums.weight;
  fitting.step = length(step.by[0], step.by[1]);
  if (!(fitting.step < 1e3f)) return false;
  check.texture = texture_of(sums);
  check.error = std::sqrt(std::max(0.f, step.variance) * fitting.difference);
  if (check.fits == 1) {
    fitting.first_step = fitting.step;
    fitting.first_difference = fitting.difference;
    if (fitting.step <= params.agree) return false;
  }
  if (check.fits == 2 && fitting.difference > kWorthwhile * fitting.first_difference) return false;
  move(check.motion, step.by, fitting.step > kLongestStep ? kLongestStep / fitting.step : 1.f);
  fitting.settled =
      fitting.step < params.settled && std::max(std::abs(step.by[2]), std::abs(step.by[5])) < 10.f * params.settled;
  return !fitting.settled;
}

}  // namespace

Check check_shift(const ImagePair& images, float dx, float dy, const CheckParams& params, const float* windows,
                  int window_pitch, float* weights) noexcept {
  Check check;
  check.motion.dx = dx;
  check.motion.dy = dy;
  const Region region = region_of(images, dx, dy, windows, window_pitch, weights);
  if (region.columns == 0) return check;
  Fitting fitting;
  while (check.fits < kMostFits && fit_once(affine_sums(images, region, check.motion), params, fitting, check)) {
  }
  const float edge = edge_motion(check.motion);
  check.corrected = fitting.difference < params.explained * fitting.first_difference;
  const bool mended =
      fitting.settled && edge <= kMostMotion && length(check.motion.dx - dx, check.motion.dy - dy) <= kMostShare * edge;
  const bool agrees = check.corrected ? mended : fitting.first_step <= params.differ;
  check.good = agrees && check.fits > 0 && check.texture >= params.least_texture && check.error <= params.most_error;
  return check;
}

}  // namespace wasp::vision::shift
