// A ray from the fovea leaves the image once, so each row of the map is inside the image up to one column; a row of the
// image meets the disc of the map in one interval.
#include "vision/kernels/log_polar.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <stdexcept>

namespace wasp::vision {
namespace {

constexpr float kTwoPi = 2.f * std::numbers::pi_v<float>;
constexpr int kMinCells = 8, kMaxCells = 4096;

float reach_px(LogPolarReach reach, float x, float y, float right, float bottom) noexcept {
  if (reach == LogPolarReach::kNearestBorder) return std::min({x, y, right - x, bottom - y});
  return std::hypot(std::max(x, right - x), std::max(y, bottom - y));
}

float into(float value, int size) noexcept {
  const float last = static_cast<float>(size - 1);
  return std::isfinite(value) ? std::clamp(value, std::min(1.f, last), std::max(last - 1.f, 0.f)) : 0.5f * last;
}

bool in_range(const LogPolarParams& p) noexcept {
  return p.angles >= kMinCells && p.angles <= kMaxCells && p.radii >= kMinCells && p.radii <= kMaxCells &&
         p.kappa >= 0.f && p.kappa <= 1.f;
}

}  // namespace

float LogPolarGeometry::rho_of(float r_px) const noexcept { return scale_M * std::log(std::max(r_px + kappa, 1.f)); }
float LogPolarGeometry::radius_of(float rho) const noexcept { return std::exp(rho / scale_M) - kappa; }
float LogPolarGeometry::rad_per_row() const noexcept { return kTwoPi / static_cast<float>(angles); }
float LogPolarGeometry::scale_of(float delta_rho) const noexcept { return std::exp(delta_rho / scale_M); }

LogPolarGeometry::MapPoint LogPolarGeometry::to_map(ImagePoint p) const noexcept {
  const float dx = p.x_px - fovea_x_px, dy = p.y_px - fovea_y_px;
  const float turn = std::atan2(dy, dx) / rad_per_row();
  const float row = turn < 0.f ? turn + static_cast<float>(angles) : turn;
  return {rho_of(std::hypot(dx, dy)), row < static_cast<float>(angles) ? row : 0.f};
}

LogPolarGeometry::ImagePoint LogPolarGeometry::to_image(MapPoint p) const noexcept {
  const float r = radius_of(p.rho), angle = p.phi * rad_per_row();
  return {fovea_x_px + r * std::cos(angle), fovea_y_px + r * std::sin(angle)};
}

LogPolarGeometry log_polar_geometry(const LogPolarParams& params, int width_px, int height_px, float fovea_x_px,
                                    float fovea_y_px) noexcept {
  LogPolarGeometry g{.kappa = params.kappa, .angles = params.angles, .radii = params.radii};
  g.fovea_x_px = into(fovea_x_px, width_px);
  g.fovea_y_px = into(fovea_y_px, height_px);
  const float right = static_cast<float>(width_px - 1), bottom = static_cast<float>(height_px - 1);
  g.r_max_px = std::max(reach_px(params.reach, g.fovea_x_px, g.fovea_y_px, right, bottom), 1.f);
  // At least one natural unit across the map, so that M stays finite for a fovea on the border with kappa = 0.
  g.scale_M = static_cast<float>(params.radii - 1) / std::log(std::max(g.r_max_px + params.kappa, 2.f));
  return g;
}

LogPolarMap::LogPolarMap(const LogPolarParams& params, int width_px, int height_px, int stride_px, float fovea_x_px,
                         float fovea_y_px) {
  if (!in_range(params)) throw std::invalid_argument("log-polar map: angles, radii or kappa out of range");
  forward_.reset(params.radii, params.angles, width_px, height_px, stride_px);
  geometry_ = log_polar_geometry(params, width_px, height_px, fovea_x_px, fovea_y_px);
  backward_.reset(width_px, height_px, params.radii, params.angles + 1, params.radii);
  fill_forward();
  forward_.finish();
  fill_backward(width_px, height_px);
  backward_.finish();
  wrapped_.resize(static_cast<std::size_t>(params.radii) * static_cast<std::size_t>(params.angles + 1));
}

void LogPolarMap::fill_forward() {
  const double right = forward_.source_width_px - 1.0, bottom = forward_.source_height_px - 1.0;
  for (int row = 0; row < geometry_.angles; ++row) {
    const double angle = 2.0 * std::numbers::pi * row / geometry_.angles;
    auto& covered = forward_.rows[static_cast<std::size_t>(row)];
    for (int column = 0; column < geometry_.radii; ++column) {
      const double r = std::exp(column / static_cast<double>(geometry_.scale_M)) - static_cast<double>(geometry_.kappa);
      const double x = static_cast<double>(geometry_.fovea_x_px) + r * std::cos(angle);
      const double y = static_cast<double>(geometry_.fovea_y_px) + r * std::sin(angle);
      constexpr double kSlack = 1e-3;  // the last column touches the border
      if (x < -kSlack || y < -kSlack || x > right + kSlack || y > bottom + kSlack) break;
      forward_.set(column, row, x, y);
      covered.end = column + 1;
    }
  }
}

void LogPolarMap::fill_backward(int width_px, int height_px) {
  const float first_r = geometry_.radius_of(0.f);
  for (int v = 0; v < height_px; ++v) {
    auto& covered = backward_.rows[static_cast<std::size_t>(v)];
    for (int u = 0; u < width_px; ++u) {
      const float x = static_cast<float>(u), y = static_cast<float>(v);
      const float r = std::hypot(x - geometry_.fovea_x_px, y - geometry_.fovea_y_px);
      if (r > geometry_.r_max_px) continue;
      const auto at = geometry_.to_map({x, y});
      backward_.set(u, v, static_cast<double>(r < first_r ? 0.f : at.rho), static_cast<double>(at.phi));
      if (covered.end == 0) covered.begin = u;
      covered.end = u + 1;
    }
  }
}

bool LogPolarMap::transform(const GrayView& image, std::uint8_t* map) const noexcept {
  return remap(forward_, image, map, forward_.width_px);
}

bool LogPolarMap::inverse(const std::uint8_t* map, std::uint8_t* image, int stride_px) noexcept {
  if (map == nullptr || wrapped_.empty()) return false;
  const auto radii = static_cast<std::size_t>(geometry_.radii),
             bytes = radii * static_cast<std::size_t>(geometry_.angles);
  std::memcpy(wrapped_.data(), map, bytes);
  std::memcpy(wrapped_.data() + bytes, map, radii);
  const GrayView source{wrapped_.data(), geometry_.radii, geometry_.angles + 1, geometry_.radii};
  return remap(backward_, source, image, stride_px);
}

}  // namespace wasp::vision
