#include "calibration/rest_periods.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wasp::calibration {
namespace {

using Eigen::Vector3d;

double middle(std::vector<double>& v) {
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

/// One axis: a rounded sensor's scatter is at least that of its rounding.
void axis_moments(std::vector<double> v, double& mean, double& sigma) {
  std::vector<double> work = v;
  const double centre = middle(work);
  double step = std::numeric_limits<double>::infinity();
  for (double& x : work) {
    x = std::fabs(x - centre);
    if (x > 0) step = std::min(step, x);
  }
  sigma = std::max(1.4826 * middle(work), std::isfinite(step) ? step / std::sqrt(12.0) : 0.0);
  double sum = 0;
  std::size_t n = 0;
  for (const double x : v)
    if (std::fabs(x - centre) <= 4 * sigma) sum += x, ++n;
  mean = n > 0 ? sum / static_cast<double>(n) : centre;
}

struct Window {
  std::size_t first = 0;
  RobustMoments moments;
  double scatter = 0;
  bool drifts = false;
};

std::vector<Window> windows_of(const Samples& s, std::size_t length, double most_drift) {
  std::vector<Window> windows;
  for (std::size_t first = 0; first + length <= s.size(); first += std::max<std::size_t>(1, length / 2)) {
    Window w{first, robust_moments(s.values, first, length)};
    w.scatter = w.moments.sigma.norm();
    const Vector3d a = robust_moments(s.values, first, length / 2).mean;
    const Vector3d b = robust_moments(s.values, first + length / 2, length - length / 2).mean;
    const double noise = 5 * w.scatter * 2 / std::sqrt(static_cast<double>(length));
    w.drifts = (a - b).norm() > std::max(most_drift, noise);
    windows.push_back(w);
  }
  return windows;
}

/// The least scatter, but not that of one lucky window.
double quiet_scatter(const std::vector<Window>& windows) {
  std::vector<double> scatter;
  for (const auto& w : windows) scatter.push_back(w.scatter);
  std::sort(scatter.begin(), scatter.end());
  return scatter[scatter.size() / 20];
}

RestPeriod period(const Samples& s, std::size_t first, std::size_t count) {
  RestPeriod p;
  p.first = first, p.count = count;
  const RobustMoments m = robust_moments(s.values, first, count);
  p.mean = m.mean;
  p.sigma_of_mean = m.sigma / std::sqrt(static_cast<double>(count));
  for (std::size_t i = first; i < first + count && !s.temperature_degc.empty(); ++i)
    p.temperature_degc += s.temperature_degc[i] / static_cast<double>(count);
  return p;
}

}  // namespace

RobustMoments robust_moments(const std::vector<Vector3d>& values, std::size_t first, std::size_t count) {
  RobustMoments m;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> v(count);
    for (std::size_t i = 0; i < count; ++i) v[i] = values[first + i][axis];
    axis_moments(std::move(v), m.mean[axis], m.sigma[axis]);
  }
  return m;
}

std::vector<RestPeriod> find_rests(const Samples& s, const RestOptions& o, double typical) {
  const double rate = s.rate_hz();
  const auto length =
      static_cast<std::size_t>(rate > 0 ? std::max(10.0, std::ceil(o.window_s * rate)) : o.window_samples);
  if (typical <= 0) {
    std::vector<double> norms;
    for (const auto& v : s.values) norms.push_back(v.norm());
    typical = norms.empty() ? 0 : middle(norms);
  }
  const auto windows = windows_of(s, length, o.most_drift * typical);
  if (windows.empty()) return {};
  const double limit = std::min(o.quiet_factor * quiet_scatter(windows), o.most_scatter * typical);
  std::vector<RestPeriod> periods;
  const Window* open = nullptr;  // the first window of the rest at hand
  std::size_t end = 0;
  const auto close = [&] {
    if (open != nullptr) periods.push_back(period(s, open->first, end - open->first));
    open = nullptr;
  };
  for (const Window& w : windows) {
    const bool rest = w.scatter <= limit && !w.drifts;
    if (open != nullptr && (!rest || (w.moments.mean - open->moments.mean).norm() > 0.02 * typical)) close();
    if (!rest) continue;
    if (open == nullptr) {
      if (w.first < end) continue;  // shares samples with the rest just closed
      open = &w;
    }
    end = w.first + length;
  }
  close();
  return periods;
}

}  // namespace wasp::calibration
