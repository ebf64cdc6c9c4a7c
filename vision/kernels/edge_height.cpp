// Rows are pooled into at most 96 bands. Distribution model: 24 steps of a logarithmic grid over mu, then 24
// golden-section steps about the best. Count model: 40 bisections.
#include "vision/kernels/edge_height.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr int kMaxBands = 96;
constexpr int kGridSteps = 24, kGoldenSteps = 24, kBisections = 40;
constexpr float kFlatRatio = 3.f;  // slope of s from top to bottom below which rows carry no information

/// One band of floor rows: its share of edges, and s at three places.
struct Band {
  float edges;  ///< E_v summed
  float slope;  ///< |s'| at the centre [1/px]
  float gap;    ///< s(v) - s(v + delta), at the centre, clipped at the last row
};

struct Bands {
  int count = 0, first_row = 0, rows = 0;
  float edges = 0;
  std::array<Band, kMaxBands> band;
};

/// A row's angle below the horizon, in the vertical plane through the optical axis.
struct RowGeometry {
  float cy_px, fy_px, up_y, up_z;

  [[nodiscard]] float ray(float v) const noexcept { return (v - cy_px) / fy_px; }
  [[nodiscard]] float down(float v) const noexcept { return -(up_y * ray(v) + up_z); }
  [[nodiscard]] float forward(float v) const noexcept { return up_z * ray(v) - up_y; }
  [[nodiscard]] float cotangent(float v) const noexcept { return forward(v) / down(v); }
  /// |ds/dv| = 1 / (f down^2): forward' down - forward down' = (up_z^2 + up_y^2) / f with a unit (up_y, up_z).
  [[nodiscard]] float slope(float v) const noexcept { return 1.f / (fy_px * down(v) * down(v)); }
  [[nodiscard]] float angle_below(float v) const noexcept { return std::atan2(down(v), forward(v)); }
};

bool sane(const EdgeHeightParams& p, const Vec3& up_cam) noexcept {
  return p.edges_per_m > 0.f && p.resolution_px > 0.f && p.edge_thickness_px > 0.f && p.min_height_m > 0.f &&
         p.max_height_m > p.min_height_m && p.horizon_margin_rad >= 0.f &&
         std::isfinite(p.edges_per_m + p.resolution_px + p.edge_thickness_px + p.max_height_m) &&
         std::abs(up_cam.squaredNorm() - 1.f) < 0.01f;
}

RowGeometry row_geometry(const Intrinsics& k, const Vec3& up_cam) noexcept {
  const float norm = std::max(std::hypot(up_cam.y(), up_cam.z()), 1e-3f);
  return {k.cy_px, k.fy_px, up_cam.y() / norm, up_cam.z() / norm};
}

/// First image row whose angle below the horizon exceeds the margin; `height_px` when there is none.
int first_floor_row(const RowGeometry& g, float margin_rad, int height_px) noexcept {
  for (int v = 1; v < height_px - 1; ++v)
    if (g.angle_below(static_cast<float>(v)) > margin_rad) return v;
  return height_px;
}

Bands pool(const EdgeHeightParams& p, const RowGeometry& g, const EdgeRows& rows) noexcept {
  Bands out;
  out.first_row = first_floor_row(g, std::max(p.horizon_margin_rad, 1e-3f), rows.height_px);
  out.rows = rows.height_px - 1 - out.first_row;
  if (out.rows < 16) return out;
  const int width = (out.rows + kMaxBands - 1) / kMaxBands;
  const auto last = static_cast<float>(rows.height_px - 2);
  for (int begin = out.first_row; begin < out.first_row + out.rows && out.count < kMaxBands; begin += width) {
    const int end = std::min(begin + width, out.first_row + out.rows);
    Band& band = out.band[static_cast<std::size_t>(out.count++)];
    const float centre = 0.5f * static_cast<float>(begin + end - 1);
    band.edges = 0.f;
    for (int v = begin; v < end; ++v) band.edges += static_cast<float>(rows.count[static_cast<std::size_t>(v)]);
    band.slope = g.slope(centre) * static_cast<float>(end - begin) / static_cast<float>(width);
    band.gap = std::max(0.f, g.cotangent(centre) - g.cotangent(std::min(centre + p.resolution_px, last)));
    out.edges += band.edges;
  }
  return out;
}

struct Distance {
  float squares = 0, largest = 0;
};

/// Distance between the measured and the modelled running share of edges (7.35, 7.31).
Distance distribution_distance(const Bands& bands, float mu) noexcept {
  std::array<float, kMaxBands> density;
  float total = 0.f;
  for (int i = 0; i < bands.count; ++i) {
    const Band& band = bands.band[static_cast<std::size_t>(i)];
    total += density[static_cast<std::size_t>(i)] = band.slope * std::exp(-mu * band.gap);
  }
  if (!(total > 1e-30f)) return {1e9f, 1.f};
  Distance out;
  float model = 0.f, measured = 0.f;
  for (int i = 0; i < bands.count; ++i) {
    model += density[static_cast<std::size_t>(i)] / total;
    measured += bands.band[static_cast<std::size_t>(i)].edges / bands.edges;
    out.squares += (model - measured) * (model - measured);
    out.largest = std::max(out.largest, std::abs(model - measured));
  }
  return out;
}

/// log(mu) of least distance within [low, high].
float minimise(const Bands& bands, float low, float high) noexcept {
  const auto cost = [&bands](float log_mu) { return distribution_distance(bands, std::exp(log_mu)).squares; };
  const float step = (high - low) / kGridSteps;
  float best = low, least = cost(low);
  for (int i = 1; i <= kGridSteps; ++i)
    if (const float at = low + static_cast<float>(i) * step, c = cost(at); c < least) best = at, least = c;
  constexpr float kGolden = 0.618034f;
  float a = std::max(low, best - step), b = std::min(high, best + step);
  for (int i = 0; i < kGoldenSteps; ++i) {
    const float left = b - kGolden * (b - a), right = a + kGolden * (b - a);
    (cost(left) < cost(right) ? b : a) = cost(left) < cost(right) ? right : left;
  }
  return 0.5f * (a + b);
}

/// Expected share of edge pixels in the floor rows.
float expected_share(const EdgeHeightParams& p, const RowGeometry& g, const Bands& bands, float mu) noexcept {
  float sum = 0.f;
  for (int i = 0; i < bands.count; ++i) {
    const float v = static_cast<float>(bands.first_row) +
                    (static_cast<float>(i) + 0.5f) * static_cast<float>(bands.rows) / static_cast<float>(bands.count);
    sum += std::min(1.f, p.edge_thickness_px * (1.f - std::exp(-mu * g.slope(v))));
  }
  return sum / static_cast<float>(bands.count);
}

float solve_count(const EdgeHeightParams& p, const RowGeometry& g, const Bands& bands, float share, float low,
                  float high) noexcept {
  for (int i = 0; i < kBisections; ++i) {
    const float middle = 0.5f * (low + high);
    (expected_share(p, g, bands, std::exp(middle)) < share ? low : high) = middle;
  }
  return 0.5f * (low + high);
}

/// (7.36) with v counted from the horizon row: mu = v^2 / (f delta). Only where there is a horizon row.
float mode_mu(const EdgeHeightParams& p, const Intrinsics& k, const RowGeometry& g, const EdgeRows& rows,
              const Bands& bands) noexcept {
  if (!(g.up_y < -0.5f)) return 0.f;
  const auto first = rows.count.begin() + bands.first_row;
  const auto most = std::max_element(first, first + bands.rows);
  const float horizon = k.cy_px - k.fy_px * g.up_z / g.up_y;
  const float v = static_cast<float>(most - rows.count.begin()) - horizon;
  return v > 0.f ? v * v / (k.fy_px * p.resolution_px) : 0.f;
}

bool rows_tell(const RowGeometry& g, int first_row, int last_row) noexcept {
  const float top = g.slope(static_cast<float>(first_row)), bottom = g.slope(static_cast<float>(last_row));
  const float ratio = std::max(top, bottom) / std::min(top, bottom);
  return ratio > kFlatRatio;
}

}  // namespace

EdgeModel suitable_model(const EdgeHeightParams& params, const Intrinsics& k, const Vec3& up_cam) noexcept {
  if (params.model != EdgeModel::kAuto || !sane(params, up_cam) || !(k.fy_px > 0.f)) return params.model;
  const RowGeometry g = row_geometry(k, up_cam);
  const int height_px = std::min(k.height_px, kMaxEdgeRows);
  const int first = first_floor_row(g, std::max(params.horizon_margin_rad, 1e-3f), height_px);
  const bool rows = first >= height_px - 2 || rows_tell(g, first, height_px - 2);
  return rows ? EdgeModel::kDistribution : EdgeModel::kCount;
}

EdgeHeight estimate_edge_height(const EdgeHeightParams& params, const Intrinsics& k, const Vec3& up_cam,
                                const EdgeRows& rows) noexcept {
  EdgeHeight out;
  if (!sane(params, up_cam) || !rows.valid || rows.height_px > kMaxEdgeRows || !(k.fy_px > 0.f) ||
      !std::isfinite(k.fy_px + k.cy_px))
    return out;
  const RowGeometry g = row_geometry(k, up_cam);
  const Bands bands = pool(params, g, rows);
  out.first_row_px = bands.first_row;
  out.rows_px = std::max(0, bands.rows);
  if (bands.count == 0 || bands.edges < static_cast<float>(std::max(params.min_edges, 1))) return out;
  const float pixels = static_cast<float>(bands.rows) * static_cast<float>(std::max(rows.width_px - 2, 1));
  out.edge_share = bands.edges / pixels;
  out.model = suitable_model(params, k, up_cam);
  const bool by_rows = out.model == EdgeModel::kDistribution;
  const float low = std::log(params.edges_per_m * params.min_height_m);
  const float high = std::log(params.edges_per_m * params.max_height_m);
  const float log_mu = by_rows ? minimise(bands, low, high) : solve_count(params, g, bands, out.edge_share, low, high);
  out.edges_per_height = std::exp(log_mu);
  out.height_m = out.edges_per_height / params.edges_per_m;
  out.mode_height_m = by_rows ? mode_mu(params, k, g, rows, bands) / params.edges_per_m : 0.f;
  out.misfit = by_rows ? distribution_distance(bands, out.edges_per_height).largest : 0.f;
  out.height_sigma_m = out.height_m * (0.2f + out.misfit);
  const float edge = 0.01f * (high - low);
  out.valid = log_mu > low + edge && log_mu < high - edge && std::isfinite(out.height_m);
  return out;
}

}  // namespace wasp::vision
