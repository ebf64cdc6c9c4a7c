// Restarts of Lloyd's algorithm around vision/kernels/cluster_pass.h. A mean that lost all its points takes the point
// farthest from its own mean, once an iteration.
#include "vision/kernels/cluster.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/cluster_pass.h"
#include "vision/kernels/pseudo_random.h"

namespace wasp::vision {
namespace {

using Pass = void (*)(const ClusterPoints&, const ClusterMeans&, ClusterPass&) WASP_REALTIME;
constexpr float kMaxCoordinate = 1e9f;

bool sane(const ClusterParams& p) noexcept {
  return p.clusters >= 1 && p.clusters <= kMaxClusters && p.restarts >= 1 && p.restarts <= 8 && p.max_iterations >= 1 &&
         p.max_iterations <= 100;
}

/// False unless all coordinates are finite and small enough to be squared and summed.
bool fill(ClusterPoints& points, std::span<const float> x, std::span<const float> y) noexcept {
  points.count = x.size();
  std::copy(x.begin(), x.end(), points.x.begin());
  std::copy(y.begin(), y.end(), points.y.begin());
  const auto usable = [](float value) { return std::abs(value) <= kMaxCoordinate; };  // false for NaN
  return std::all_of(x.begin(), x.end(), usable) && std::all_of(y.begin(), y.end(), usable);
}

void set_mean(ClusterMeans& means, std::size_t c, const ClusterPoints& points, std::size_t point) noexcept {
  means.x[c] = points.x[point];
  means.y[c] = points.y[point];
}

/// A point drawn with probability proportional to its squared distance to the nearest mean.
std::size_t draw_far(const ClusterPoints& points, const ClusterPass& pass, PseudoRandom& random) noexcept {
  float rest = random.uniform() * pass.compactness;
  std::size_t i = 0;
  while (i + 1 < points.count && (rest -= pass.distance2[i]) >= 0.f) ++i;
  return i;
}

/// k-means++ (Arthur and Vassilvitskii 2007).
ClusterMeans draw_means(const ClusterPoints& points, int k, Pass pass, ClusterPass& work,
                        PseudoRandom& random) noexcept {
  ClusterMeans means{.count = 1};
  set_mean(means, 0, points, static_cast<std::size_t>(random.below(static_cast<int>(points.count))));
  for (; means.count < k; ++means.count) {
    pass(points, means, work);
    set_mean(means, static_cast<std::size_t>(means.count), points, draw_far(points, work, random));
  }
  return means;
}

std::size_t farthest(const ClusterPoints& points, const ClusterPass& pass) noexcept {
  const auto end = pass.distance2.begin() + static_cast<std::ptrdiff_t>(points.count);
  return static_cast<std::size_t>(std::max_element(pass.distance2.begin(), end) - pass.distance2.begin());
}

ClusterMeans next_means(const ClusterPoints& points, const ClusterMeans& means, const ClusterPass& pass) noexcept {
  ClusterMeans next = means;
  bool refilled = false;
  for (std::size_t c = 0; c < static_cast<std::size_t>(means.count); ++c)
    if (pass.size[c] > 0.f) {
      next.x[c] = pass.sum_x[c] / pass.size[c];
      next.y[c] = pass.sum_y[c] / pass.size[c];
    } else if (const std::size_t far = farthest(points, pass); !refilled && pass.distance2[far] > 0.f) {
      set_mean(next, c, points, far);
      refilled = true;
    }
  return next;
}

/// Clusters in the order of their means, empty ones last, so that equal partitions look equal.
void describe(const ClusterPoints& points, const ClusterMeans& means, const ClusterPass& pass, Clusters& out) noexcept {
  std::array<std::size_t, kMaxClusters> order{0, 1, 2, 3};
  const auto before = [&](std::size_t a, std::size_t b) {
    if ((pass.size[a] > 0.f) != (pass.size[b] > 0.f)) return pass.size[a] > 0.f;
    return means.x[a] != means.x[b] ? means.x[a] < means.x[b] : means.y[a] < means.y[b];
  };
  for (int i = 1; i < means.count; ++i)
    for (auto j = static_cast<std::size_t>(i); j > 0 && before(order[j], order[j - 1]); --j)
      std::swap(order[j], order[j - 1]);
  std::array<std::uint8_t, kMaxClusters> rank{};
  for (std::size_t i = 0; i < static_cast<std::size_t>(means.count); ++i) {
    const std::size_t c = order[i];
    rank[c] = static_cast<std::uint8_t>(i);
    out.cluster[i] = {means.x[c], means.y[c], static_cast<int>(pass.size[c])};
  }
  for (std::size_t i = 0; i < points.count; ++i) out.label[i] = rank[static_cast<std::size_t>(pass.label[i])];
  out.count = means.count;
  out.compactness = pass.compactness;
}

Clusters cluster_with(const ClusterParams& params, std::span<const float> x, std::span<const float> y,
                      Pass pass) noexcept {
  Clusters out;
  if (!sane(params) || x.empty() || x.size() != y.size() || x.size() > kMaxObservations) return out;
  ClusterPoints points;
  if (!fill(points, x, y)) return out;
  const int k = std::min(params.clusters, static_cast<int>(points.count));
  PseudoRandom random{params.seed};
  ClusterPass work;
  for (int restart = 0; restart < params.restarts; ++restart) {
    ClusterMeans means = draw_means(points, k, pass, work, random);
    for (int i = 0; i < params.max_iterations; ++i, ++out.iterations) {
      pass(points, means, work);
      const ClusterMeans next = next_means(points, means, work);
      if (next == means || i + 1 == params.max_iterations) break;
      means = next;
    }
    ++out.iterations;
    if (restart == 0 || work.compactness < out.compactness) describe(points, means, work, out);
  }
  out.valid = true;
  return out;
}

}  // namespace

Clusters cluster_points(const ClusterParams& params, std::span<const float> x, std::span<const float> y) noexcept {
  return cluster_with(params, x, y, &cluster_pass_simd);
}

Clusters cluster_points_reference(const ClusterParams& params, std::span<const float> x,
                                  std::span<const float> y) noexcept {
  return cluster_with(params, x, y, &cluster_pass_reference);
}

}  // namespace wasp::vision
