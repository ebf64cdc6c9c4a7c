// With weighted means removed, z - 1 = sum w conj(p) f / sum w |p|^2: no matrix to invert.
#include "vision/kernels/similarity_fit.h"

#include <cmath>

#include "vision/kernels/flow_points.h"
#include "vision/kernels/pseudo_random.h"

namespace wasp::vision {
namespace {

constexpr float kMinSpread_px = 4.f;  // rms distance of the cells from their mean

/// f = (a + ib) p + t.
struct Motion {
  float a = 0, b = 0, tu = 0, tv = 0;

  [[nodiscard]] float residual_squared(const FlowPoint& p) const noexcept {
    const float ru = p.u - (a * p.x - b * p.y + tu), rv = p.v - (b * p.x + a * p.y + tv);
    return ru * ru + rv * rv;
  }
};

bool motion_of_pair(const FlowPoint& p, const FlowPoint& q, Motion& out) noexcept {
  const float dx = q.x - p.x, dy = q.y - p.y, du = q.u - p.u, dv = q.v - p.v;
  const float square = dx * dx + dy * dy;
  if (!(square > kMinSpread_px * kMinSpread_px)) return false;
  out.a = (dx * du + dy * dv) / square;
  out.b = (dx * dv - dy * du) / square;
  out.tu = p.u - (out.a * p.x - out.b * p.y);
  out.tv = p.v - (out.b * p.x + out.a * p.y);
  return true;
}

/// Sum of squared residuals, each at most 1 in units of `limit`.
float cost_of(std::span<const FlowPoint> points, const Motion& m, float limit) noexcept {
  const float scale = 1.f / (limit * limit);
  float cost = 0;
  for (const FlowPoint& p : points) cost += std::min(m.residual_squared(p) * scale, 1.f);
  return cost;
}

Motion consensus(std::span<const FlowPoint> points, float limit) noexcept {
  PseudoRandom random{1};
  Motion best;
  float best_cost = cost_of(points, best, limit);
  const int n = static_cast<int>(points.size());
  for (int trial = 0; trial < kSimilarityTrials; ++trial) {
    const auto i = static_cast<std::size_t>(random.below(n)), j = static_cast<std::size_t>(random.below(n));
    Motion m;
    if (!motion_of_pair(points[i], points[j], m)) continue;
    if (const float cost = cost_of(points, m, limit); cost < best_cost) best = m, best_cost = cost;
  }
  return best;
}

/// One weighted least-squares step; `spread` becomes the weighted sum of squared distances from the mean.
struct Solved {
  Motion motion;
  float weight = 0, spread = 0;
};

Solved solve(std::span<const FlowPoint> points, const Motion& from, float limit) noexcept {
  std::array<float, kMaxFlowPoints> weight;
  double w = 0, x = 0, y = 0, u = 0, v = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const FlowPoint& p = points[i];
    weight[i] = biweight(from.residual_squared(p), limit);
    const auto wi = static_cast<double>(weight[i]);
    w += wi, x += wi * static_cast<double>(p.x), y += wi * static_cast<double>(p.y);
    u += wi * static_cast<double>(p.u), v += wi * static_cast<double>(p.v);
  }
  Solved out{from, static_cast<float>(w), 0.f};
  if (!(w > 0)) return out;
  x /= w, y /= w, u /= w, v /= w;
  double dot = 0, cross = 0, square = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const FlowPoint& p = points[i];
    const double dx = static_cast<double>(p.x) - x, dy = static_cast<double>(p.y) - y;
    const double du = static_cast<double>(p.u) - u, dv = static_cast<double>(p.v) - v;
    const auto wi = static_cast<double>(weight[i]);
    dot += wi * (dx * du + dy * dv), cross += wi * (dx * dv - dy * du), square += wi * (dx * dx + dy * dy);
  }
  if (!(square > 0)) return out;
  const double a = dot / square, b = cross / square;
  out.motion = {static_cast<float>(a), static_cast<float>(b), static_cast<float>(u - (a * x - b * y)),
                static_cast<float>(v - (b * x + a * y))};
  out.spread = static_cast<float>(square);
  return out;
}

/// Robust sigma per axis: the median of a Rayleigh variable is 1.1774 sigma.
float scale_of(std::span<const FlowPoint> points, const Motion& m) noexcept {
  std::array<float, kMaxFlowPoints> size;
  for (std::size_t i = 0; i < points.size(); ++i) size[i] = std::sqrt(m.residual_squared(points[i]));
  return median_in_place({size.data(), points.size()}) / 1.1774f;
}

void report(const SimilarityFitParams& params, std::span<const FlowPoint> points, const Solved& solved, float limit,
            SimilarityFit& fit) noexcept {
  const Motion& m = solved.motion;
  double squares = 0;
  for (const FlowPoint& p : points) {
    const float r2 = m.residual_squared(p);
    if (r2 >= limit * limit) continue;
    ++fit.inliers;
    squares += static_cast<double>(r2);
  }
  const float real = 1.f + m.a, scale = std::hypot(real, m.b);
  fit.rotation_rad = std::atan2(m.b, real);
  fit.log_scale = std::log(scale);
  fit.shift_u_px = m.tu, fit.shift_v_px = m.tv;
  const int freedom = 2 * fit.inliers - 4;
  if (freedom <= 0 || !(solved.weight > 0.f)) return;
  fit.residual_px = static_cast<float>(std::sqrt(squares / freedom));
  const float sigma = std::max(fit.residual_px, params.flow_sigma_px) / std::sqrt(std::max(solved.spread, 1e-6f));
  fit.rotation_sigma_rad = fit.log_scale_sigma = sigma / scale;
  const bool spread = solved.spread > solved.weight * kMinSpread_px * kMinSpread_px;
  fit.valid = spread && fit.inliers >= params.min_cells && std::isfinite(fit.log_scale) &&
              std::isfinite(fit.rotation_rad) && scale > 0.1f &&
              static_cast<float>(fit.inliers) >= params.min_inlier_share * static_cast<float>(fit.cells);
}

}  // namespace

SimilarityFit fit_similarity(const SimilarityFitParams& params, const FlowField& flow) noexcept {
  SimilarityFit fit;
  FlowPoints all;
  collect_points(flow, params.centre_x_px, params.centre_y_px, all);
  fit.cells = all.count;
  if (fit.cells < std::max(params.min_cells, 3) || !(params.inlier_px > 0.f) || !(params.flow_sigma_px > 0.f))
    return fit;
  const auto points = all.view();
  Solved solved{consensus(points, params.inlier_px)};
  float limit = params.inlier_px;
  for (int round = 0; round < kSimilarityRounds; ++round) {
    solved = solve(points, solved.motion, limit);
    const float sigma = std::max(scale_of(points, solved.motion), params.flow_sigma_px);
    limit = std::min(kBiweightSigmas * sigma, params.inlier_px);
  }
  report(params, points, solved, limit, fit);
  return fit;
}

}  // namespace wasp::vision
