// A region whose columns lie about the radius r and move by d columns has r + kappa grown by e^(d / M); the image scale
// is the ratio of the radii, which for kappa = 0 is the same everywhere.
#include "vision/kernels/heading_log_polar.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace wasp::vision {
namespace {

constexpr int kSide = kHeadingMapSide, kRegion = kHeadingRegionSide;
constexpr std::size_t kMapBytes = static_cast<std::size_t>(kSide) * kSide;

/// (1 4 6 4 1) / 16 along five values.
int binomial(int a, int b, int c, int d, int e) noexcept { return (a + e + 4 * (b + d) + 6 * c + 8) >> 4; }

float variance_of(const std::uint8_t* map, int row, int column) noexcept {
  int sum = 0, squares = 0;
  for (int y = row; y < row + kRegion; ++y)
    for (int x = column; x < column + kRegion; ++x) {
      const int value = map[y * kSide + x];
      sum += value, squares += value * value;
    }
  constexpr float kCount = static_cast<float>(kRegion) * kRegion;
  const float mean = static_cast<float>(sum) / kCount;
  return static_cast<float>(squares) / kCount - mean * mean;
}

GrayView region_of(const std::vector<std::uint8_t>& map, int row, int column) noexcept {
  return {map.data() + row * kSide + column, kRegion, kRegion, kSide};
}

}  // namespace

HeadingLogPolar::HeadingLogPolar(int width_px, int height_px, int stride_px, const HeadingLogPolarParams& params)
    : params_(params),
      map_({.angles = kSide, .radii = kSide}, width_px, height_px, stride_px, 0.5f * static_cast<float>(width_px - 1),
           0.5f * static_cast<float>(height_px - 1)),
      shift_(kRegion, kRegion),
      last_(kMapBytes),
      now_(kMapBytes),
      sharp_(kMapBytes) {
  if (params.regions < 1 || params.regions > kHeadingRegions || params.min_regions < 1 ||
      params.min_regions > params.regions || !(params.max_relative_sigma > 0.f))
    throw std::invalid_argument("HeadingLogPolar: regions 1 ... 8, min_regions 1 ... regions, max_relative_sigma > 0");
}

/// Rows wrap, as the angle does; columns end.
void HeadingLogPolar::blur() noexcept {
  for (int y = 0; y < kSide; ++y) {
    const std::uint8_t* in[5];
    for (int k = 0; k < 5; ++k) in[k] = sharp_.data() + ((y + k - 2 + kSide) % kSide) * kSide;
    std::array<std::uint8_t, kSide> column;
    for (std::size_t x = 0; x < kSide; ++x)
      column[x] = static_cast<std::uint8_t>(binomial(in[0][x], in[1][x], in[2][x], in[3][x], in[4][x]));
    std::uint8_t* out = now_.data() + y * kSide;
    for (int x = 0; x < kSide; ++x) {
      const auto at = [&](int i) {
        return static_cast<int>(column[static_cast<std::size_t>(std::clamp(i, 0, kSide - 1))]);
      };
      out[x] = static_cast<std::uint8_t>(binomial(at(x - 2), at(x - 1), at(x), at(x + 1), at(x + 2)));
    }
  }
}

/// The regions of the last map by texture; returns how many have enough, at most params_.regions.
int HeadingLogPolar::choose_regions() noexcept {
  std::size_t n = 0;
  for (int row = 0; row < kSide; row += kRegion)
    for (int column = kSide / 2; column < kSide; column += kRegion)
      regions_[n++] = {row, column, variance_of(last_.data(), row, column)};
  std::sort(regions_.begin(), regions_.end(), [](const Region& a, const Region& b) { return a.variance > b.variance; });
  int count = 0;
  while (count < params_.regions && regions_[static_cast<std::size_t>(count)].variance >= params_.min_variance) ++count;
  return count;
}

bool HeadingLogPolar::measure(const Region& region, Shift& out) noexcept {
  const ImageShift found =
      shift_.estimate(region_of(last_, region.row, region.column), region_of(now_, region.row, region.column));
  if (!found.valid) return false;
  const LogPolarGeometry& g = map_.geometry();
  const float rho = static_cast<float>(region.column) + 0.5f * (kRegion - 1);
  const float before = g.radius_of(rho), after = g.radius_of(rho + found.x_px);
  if (!(before > 0.f) || !(after > 0.f)) return false;
  out = {found.y_px * g.rad_per_row(), std::log(after / before)};
  return true;
}

HeadingRate HeadingLogPolar::mean_of(int count) const noexcept {
  HeadingRate rate;
  if (count < params_.min_regions) return rate;
  float turn = 0, scale = 0, turn_squares = 0, scale_squares = 0;
  for (int i = 0; i < count; ++i) {
    const Shift& s = shifts_[static_cast<std::size_t>(i)];
    turn += s.turn_rad, scale += s.log_scale;
  }
  const float n = static_cast<float>(count);
  turn /= n, scale /= n;
  for (int i = 0; i < count; ++i) {
    const Shift& s = shifts_[static_cast<std::size_t>(i)];
    turn_squares += (s.turn_rad - turn) * (s.turn_rad - turn);
    scale_squares += (s.log_scale - scale) * (s.log_scale - scale);
  }
  const float freedom = std::max(n - 1.f, 1.f);
  const float limit_rad = params_.max_relative_sigma * kRegion * map_.geometry().rad_per_row();
  rate.yaw_rad = -turn;
  rate.height_ratio = std::exp(-scale);
  rate.yaw_sigma_rad = std::sqrt(turn_squares / freedom / n);
  rate.height_ratio_sigma = rate.height_ratio * std::sqrt(scale_squares / freedom / n);
  rate.valid = rate.yaw_sigma_rad * std::sqrt(n) <= limit_rad &&
               std::sqrt(scale_squares / freedom) <= params_.max_relative_sigma;
  return rate;
}

HeadingRate HeadingLogPolar::step(const GrayView& image) noexcept {
  if (!map_.transform(image, sharp_.data())) {
    has_last_ = false;
    return {};
  }
  blur();
  int found = 0;
  if (has_last_) {
    const int count = choose_regions();
    for (int i = 0; i < count; ++i)
      found += measure(regions_[static_cast<std::size_t>(i)], shifts_[static_cast<std::size_t>(found)]) ? 1 : 0;
  }
  std::swap(last_, now_);
  has_last_ = true;
  return mean_of(found);
}

}  // namespace wasp::vision
