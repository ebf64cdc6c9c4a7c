// Each cell votes for the growth q = r'/r (or (e^(d rho / M) - 1) in a map) with variance sigma^2 / r^2; the weighted
// median starts, Tukey weights polish, kRounds times.
#include "vision/kernels/time_to_contact.h"

#include <cmath>

#include "vision/kernels/flow_points.h"

namespace wasp::vision {
namespace {

constexpr int kRounds = 6;

/// One cell's vote.
struct Vote {
  float growth = 0, radius_px = 0;  ///< q, and r, which is the weight
  float ring_radius = 0, ring_flow = 0;
};

struct Votes {
  std::array<Vote, kMaxFlowPoints> all{};
  int count = 0;
  float nearest = 0, farthest = 0;  ///< of ring_radius
};

float residual_px(const Vote& v, float growth) noexcept { return (v.growth - growth) * v.radius_px; }

void add_vote(Votes& votes, const Vote& vote) noexcept {
  if (!std::isfinite(vote.growth + vote.ring_flow)) return;
  votes.nearest = votes.count == 0 ? vote.ring_radius : std::min(votes.nearest, vote.ring_radius);
  votes.farthest = votes.count == 0 ? vote.ring_radius : std::max(votes.farthest, vote.ring_radius);
  votes.all[static_cast<std::size_t>(votes.count++)] = vote;
}

float median_growth(const Votes& votes) noexcept {
  std::array<float, kMaxFlowPoints> growth;
  for (int i = 0; i < votes.count; ++i)
    growth[static_cast<std::size_t>(i)] = votes.all[static_cast<std::size_t>(i)].growth;
  return median_in_place({growth.data(), static_cast<std::size_t>(votes.count)});
}

float robust_sigma(const Votes& votes, float growth) noexcept {
  std::array<float, kMaxFlowPoints> size;
  for (int i = 0; i < votes.count; ++i)
    size[static_cast<std::size_t>(i)] = std::abs(residual_px(votes.all[static_cast<std::size_t>(i)], growth));
  return 1.4826f * median_in_place({size.data(), static_cast<std::size_t>(votes.count)});
}

TimeToContact judged(const TimeToContactParams& params, float growth, float sigma, int cells) noexcept {
  TimeToContact out{.growth_per_frame = growth, .growth_sigma = sigma, .cells = cells};
  out.valid = std::isfinite(growth) && sigma > 0.f && std::isfinite(sigma) &&
              std::abs(growth) > params.significance * sigma && std::abs(growth) * params.max_frames >= 1.f;
  out.frames = out.valid ? 1.f / growth : 0.f;
  return out;
}

void fill_rings(const TimeToContactParams& params, const Votes& votes, float growth, float limit,
                ContactRings& rings) noexcept {
  const int n = std::clamp(params.rings, 1, kMaxContactRings);
  std::array<float, kMaxContactRings> sum_growth{};
  for (int i = 0; i < votes.count; ++i) {
    const Vote& v = votes.all[static_cast<std::size_t>(i)];
    if (std::abs(residual_px(v, growth)) >= limit) continue;
    const float share = (v.ring_radius - votes.nearest) / std::max(votes.farthest - votes.nearest, 1e-6f);
    const auto k = static_cast<std::size_t>(std::clamp(static_cast<int>(share * static_cast<float>(n)), 0, n - 1));
    rings[k].radius += v.ring_radius, rings[k].radial_flow += v.ring_flow, sum_growth[k] += v.growth;
    ++rings[k].cells;
  }
  for (std::size_t k = 0; k < rings.size(); ++k) {
    ContactRing& ring = rings[k];
    if (ring.cells == 0) continue;
    const float cells = static_cast<float>(ring.cells), mean = sum_growth[k] / cells;
    ring.radius /= cells, ring.radial_flow /= cells;
    ring.frames = mean * growth > 0.f ? 1.f / mean : 0.f;
  }
}

TimeToContact estimate(const TimeToContactParams& params, const Votes& votes, ContactRings* rings) noexcept {
  if (votes.count < std::max(params.min_cells, 2) || !(params.flow_sigma_px > 0.f)) return {.cells = votes.count};
  float growth = median_growth(votes), limit = 0, sigma = 0;
  double weight = 0;
  for (int round = 0; round < kRounds; ++round) {
    sigma = std::max(robust_sigma(votes, growth), params.flow_sigma_px);
    limit = kBiweightSigmas * sigma;
    double sum = 0;
    weight = 0;
    for (int i = 0; i < votes.count; ++i) {
      const Vote& v = votes.all[static_cast<std::size_t>(i)];
      const float r = residual_px(v, growth);
      const auto w = static_cast<double>(biweight(r * r, limit) * v.radius_px * v.radius_px);
      weight += w, sum += w * static_cast<double>(v.growth);
    }
    if (!(weight > 0)) return {.cells = votes.count};
    growth = static_cast<float>(sum / weight);
  }
  if (rings != nullptr) fill_rings(params, votes, growth, limit, *rings);
  return judged(params, growth, sigma / static_cast<float>(std::sqrt(weight)), votes.count);
}

}  // namespace

TimeToContact contact_from_rings(const TimeToContactParams& params, const FlowField& flow, float foe_x_px,
                                 float foe_y_px, ContactRings* rings) noexcept {
  if (rings != nullptr) *rings = ContactRings{};
  FlowPoints points;
  collect_points(flow, foe_x_px, foe_y_px, points);
  Votes votes;
  for (const FlowPoint& p : points.view()) {
    const float r = std::hypot(p.x, p.y);
    if (!(r >= std::max(params.min_radius_px, 1.f)) || !std::isfinite(r)) continue;
    const float radial = (p.u * p.x + p.v * p.y) / r;
    add_vote(votes, {radial / r, r, r, radial});
  }
  return estimate(params, votes, rings);
}

TimeToContact contact_from_log_polar(const TimeToContactParams& params, const FlowField& flow,
                                     const LogPolarGeometry& map, ContactRings* rings) noexcept {
  if (rings != nullptr) *rings = ContactRings{};
  if (!(map.scale_M > 0.f)) return {};
  FlowPoints points;
  collect_points(flow, map.fovea_x_px, map.fovea_y_px, points);
  Votes votes;
  for (const FlowPoint& p : points.view()) {
    const float r = std::hypot(p.x, p.y);
    if (!(r >= std::max(params.min_radius_px, 1.f)) || r > map.r_max_px) continue;
    const float first = map.rho_of(r), second = map.rho_of(std::hypot(p.x + p.u, p.y + p.v));
    // Exact inversion of rho = M log(r + kappa): r' = (r + kappa) (e^(d rho / M) - 1).
    const float growth = (r + map.kappa) / r * (std::exp((second - first) / map.scale_M) - 1.f);
    add_vote(votes, {growth, r, first, second - first});
  }
  return estimate(params, votes, rings);
}

TimeToContact contact_from_scale(const TimeToContactParams& params, float log_scale, float log_scale_sigma,
                                 int frames) noexcept {
  if (frames < 1) return {};
  const float n = static_cast<float>(frames), scale = std::exp(log_scale);
  return judged(params, (scale - 1.f) / n, scale * log_scale_sigma / n, 0);
}

ContactWindow::ContactWindow(int window, const TimeToContactParams& params) noexcept
    : params_(params), window_(std::clamp(window, 1, kMaxContactWindow)) {}

TimeToContact ContactWindow::add(const SimilarityFit& fit) noexcept {
  if (!fit.valid || !std::isfinite(fit.log_scale + fit.log_scale_sigma)) {
    reset();
    return {};
  }
  if (count_ == window_) {
    std::copy(history_.begin() + 1, history_.begin() + count_, history_.begin());
    --count_;
  }
  history_[static_cast<std::size_t>(count_++)] = {fit.log_scale, fit.log_scale_sigma};
  if (count_ < window_) return {};
  float sum = 0, variance = 0;
  for (int i = 0; i < count_; ++i) {
    const Growth& g = history_[static_cast<std::size_t>(i)];
    sum += g.log_scale, variance += g.sigma * g.sigma;
  }
  TimeToContact out = contact_from_scale(params_, sum, std::sqrt(variance), window_);
  out.cells = fit.inliers;
  return out;
}

}  // namespace wasp::vision
