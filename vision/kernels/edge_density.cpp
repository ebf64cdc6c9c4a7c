// Integrate, sample into the ring, regress (three rounds, for priors and noise depend on the answer), fuse.
#include "vision/kernels/edge_density.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr DurationNs kLongestGap = kSecond / 2;
constexpr int kRounds = 3;
constexpr double kLeastNoise = 0.02;  // of mu: it is no better than this whatever the residuals say

using Sample = EdgeDensityState::Sample;

/// The ring's samples, oldest first, in the window's own terms: t and Z from its first sample at rest.
struct Window {
  int count = 0;
  std::array<double, EdgeDensityState::kSamples> t_s, z_m, mu;
  double mean_mu = 0, length_s = 0;
};

Window window_of(const EdgeDensityState& state) noexcept {
  Window w;
  w.count = state.count;
  const int oldest = (state.next - state.count + 2 * EdgeDensityState::kSamples) % EdgeDensityState::kSamples;
  const Sample& first = state.ring[static_cast<std::size_t>(oldest)];
  for (int i = 0; i < w.count; ++i) {
    const Sample& s = state.ring[static_cast<std::size_t>((oldest + i) % EdgeDensityState::kSamples)];
    const auto k = static_cast<std::size_t>(i);
    w.t_s[k] = to_seconds(s.at_ns - first.at_ns);
    w.z_m[k] = s.way - first.way - first.speed * w.t_s[k];
    w.mu[k] = s.mu;
    w.mean_mu += s.mu / w.count;
    w.length_s = w.t_s[k];
  }
  return w;
}

/// Least squares with priors: `information` is that of one sample, `prior` that of each unknown about zero.
template <int kUnknowns>
struct Regression {
  using Row = Eigen::Matrix<double, kUnknowns, 1>;
  using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  Normal normal = Normal::Zero();
  Row right = Row::Zero(), solution = Row::Zero();

  void add(const Row& row, double value, double information) noexcept {
    for (int i = 0; i < kUnknowns; ++i) {
      for (int j = 0; j < kUnknowns; ++j) normal(i, j) += information * row(i) * row(j);
      right(i) += information * row(i) * value;
    }
  }
  void solve(const Row& prior) noexcept {
    for (int i = 0; i < kUnknowns; ++i) normal(i, i) += prior(i);
    solution = normal.ldlt().solve(right);
  }
  [[nodiscard]] double sigma_of(int unknown) const noexcept {
    Row unit = Row::Zero();
    unit(unknown) = 1.0;
    const Row column = normal.ldlt().solve(unit);
    return std::sqrt(std::max(column(unknown), 0.0));
  }
};

double square(double x) noexcept { return x * x; }

/// Information of one sample, errors near in time taken as one.
double information_of(const EdgeDensityParams& p, const Window& w, double noise) noexcept {
  const double spacing_s = w.length_s / std::max(w.count - 1, 1);
  return 1.0 / (square(noise) * std::max(1.0, static_cast<double>(p.correlation_s) / std::max(spacing_s, 1e-3)));
}

/// Range of what a quadratic within the priors leaves of Z.
double excitation_m(const EdgeDensityParams& p, const Window& w, double noise_m) noexcept {
  Regression<3> r;
  const double information = information_of(p, w, noise_m);
  const auto row = [&w](std::size_t k) noexcept { return Eigen::Vector3d(1.0, w.t_s[k], 0.5 * square(w.t_s[k])); };
  for (std::size_t k = 0; k < static_cast<std::size_t>(w.count); ++k) r.add(row(k), w.z_m[k], information);
  r.solve({1e-9, 1.0 / square(static_cast<double>(p.climb_sigma_mps)),
           1.0 / square(static_cast<double>(p.bias_sigma_mps2))});
  double low = 0, high = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(w.count); ++k) {
    const double left = w.z_m[k] - row(k).dot(r.solution);
    low = k == 0 ? left : std::min(low, left);
    high = k == 0 ? left : std::max(high, left);
  }
  return high - low;
}

bool sane(const EdgeDensityParams& p) noexcept {
  return p.window_s > 0.f && p.climb_sigma_mps > 0.f && p.bias_sigma_mps2 > 0.f && p.correlation_s >= 0.f &&
         std::isfinite(p.window_s + p.climb_sigma_mps + p.bias_sigma_mps2 + p.correlation_s);
}

void forget(EdgeDensityState& state) noexcept {
  state.count = 0;
  state.speed_mps = state.way_m = 0;
}

/// Drops samples that have left the window.
void expire(const EdgeDensityParams& p, TimeNs at_ns, EdgeDensityState& state) noexcept {
  const auto oldest = [&state] {
    return (state.next - state.count + 2 * EdgeDensityState::kSamples) % EdgeDensityState::kSamples;
  };
  for (int i = 0; i < EdgeDensityState::kSamples && state.count > 0; ++i) {
    const TimeNs first_ns = state.ring[static_cast<std::size_t>(oldest())].at_ns;
    if (to_seconds(at_ns - first_ns) <= static_cast<double>(p.window_s)) break;
    --state.count;
  }
}

void fuse(const EdgeDensityParams& p, TimeNs at_ns, const EdgeDensityFit& fit, EdgeDensityState& state) noexcept {
  EdgeDensity& d = state.density;
  double value = fit.edges_per_m, variance = square(fit.sigma);
  if (d.accepted > 0) {
    const double age_s = std::max(0.0, to_seconds(at_ns - state.refined_at_ns));
    const double old = static_cast<double>(d.edges_per_m);
    const double held =
        square(static_cast<double>(d.sigma)) + square(static_cast<double>(p.drift_share_sqrts) * old) * age_s;
    const double share = held / (held + variance);
    value = old + share * (value - old);
    variance = (1.0 - share) * held;
  }
  d = {static_cast<float>(value), static_cast<float>(std::sqrt(variance)), d.accepted + 1};
  state.refined_at_ns = at_ns;
}

}  // namespace

EdgeDensityFit fit_edge_density(const EdgeDensityParams& params, const EdgeDensityState& state,
                                double start_edges_per_m) noexcept {
  EdgeDensityFit out;
  if (!sane(params) || state.count < EdgeDensityState::kSamples / 4 || !(start_edges_per_m > 0.0)) return out;
  const Window w = window_of(state);
  double lambda = start_edges_per_m, noise = std::max(0.1 * w.mean_mu, 1e-9);
  const auto row = [&w](std::size_t k) noexcept {
    return Eigen::Vector4d(w.z_m[k], 1.0, w.t_s[k], 0.5 * square(w.t_s[k]));
  };
  for (int round = 0; round < kRounds; ++round) {
    Regression<4> r;
    const double information = information_of(params, w, noise);
    for (std::size_t k = 0; k < static_cast<std::size_t>(w.count); ++k) r.add(row(k), w.mu[k], information);
    r.solve({1e-12, 1e-12, 1.0 / square(lambda * static_cast<double>(params.climb_sigma_mps)),
             1.0 / square(lambda * static_cast<double>(params.bias_sigma_mps2))});
    out.edges_per_m = r.solution(0);
    out.sigma = r.sigma_of(0);
    double squares = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(w.count); ++k)
      squares += square(w.mu[k] - row(k).dot(r.solution));
    noise = std::max(std::sqrt(squares / (w.count - 2)), kLeastNoise * w.mean_mu);
    if (!(out.edges_per_m > 0.0) || !std::isfinite(out.sigma + noise)) return out;
    lambda = out.edges_per_m;
  }
  out.excitation_m = excitation_m(params, w, noise / lambda);
  out.valid = out.excitation_m >= static_cast<double>(params.min_excitation_m) &&
              out.sigma <= static_cast<double>(params.max_sigma_share) * out.edges_per_m;
  return out;
}

void observe_edge_density(const EdgeDensityParams& params, TimeNs at_ns, double mu, bool accel_valid,
                          double up_accel_mps2, float start_edges_per_m, EdgeDensityState& state) noexcept {
  const bool follows = state.last_at_ns != kNever && at_ns > state.last_at_ns &&
                       at_ns / 2 - state.last_at_ns / 2 < kLongestGap / 2;  // halves cannot overflow
  const double dt_s = follows ? to_seconds(at_ns - state.last_at_ns) : 0.0;
  state.last_at_ns = at_ns;
  if (!follows || !accel_valid || !(std::abs(up_accel_mps2) < 50.0)) return forget(state);
  state.way_m += (state.speed_mps + 0.5 * up_accel_mps2 * dt_s) * dt_s;
  state.speed_mps += up_accel_mps2 * dt_s;
  expire(params, at_ns, state);
  if (!(mu > 0.0) || !std::isfinite(mu)) return;
  const auto newest =
      static_cast<std::size_t>((state.next + EdgeDensityState::kSamples - 1) % EdgeDensityState::kSamples);
  const double spacing_s = static_cast<double>(params.window_s) / (EdgeDensityState::kSamples - 1);
  if (state.count > 0 && to_seconds(at_ns - state.ring[newest].at_ns) < spacing_s) return;
  state.ring[static_cast<std::size_t>(state.next)] = {at_ns, mu, state.speed_mps, state.way_m};
  state.next = (state.next + 1) % EdgeDensityState::kSamples;
  state.count = std::min(state.count + 1, EdgeDensityState::kSamples);
  const float known = state.density.accepted > 0 ? state.density.edges_per_m : start_edges_per_m;
  const EdgeDensityFit fit = fit_edge_density(params, state, static_cast<double>(known));
  if (!fit.valid) return;
  fuse(params, at_ns, fit, state);
  state.count = 0;
}

}  // namespace wasp::vision
