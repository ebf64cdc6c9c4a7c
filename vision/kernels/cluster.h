// k-means (6.12) of up to 192 two-dimensional observations, at most 4 clusters, 3 restarts, bounded iterations: Lloyd's
// algorithm with k-means++ starts drawn from a fixed seed, so that equal input gives equal clusters. Observations lie
// one to a SIMD lane; the restart with the least compactness wins.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "types/realtime.h"

namespace wasp::vision {

inline constexpr int kMaxObservations = 192;  ///< cells of the largest flow grid
inline constexpr int kMaxClusters = 4;

struct ClusterParams {
  int clusters = 3;         ///< k: 1 ... kMaxClusters
  int restarts = 3;         ///< 1 ... 8
  int max_iterations = 20;  ///< of each restart, 1 ... 100
  std::uint32_t seed = 1;
};

struct Cluster {
  float x = 0, y = 0;  ///< mean of its observations
  int size = 0;        ///< 0: fewer different observations than clusters
};

struct Clusters {
  bool valid = false;
  int count = 0;                                       ///< k, or the number of observations if that is less
  float compactness = 0;                               ///< sum of squared distances to the own mean
  int iterations = 0;                                  ///< of all restarts together: the trip count
  std::array<Cluster, kMaxClusters> cluster{};         ///< rising x, then rising y of the mean; empty ones last
  std::array<std::uint8_t, kMaxObservations> label{};  ///< of each observation
};

/// Clusters the points (x[i], y[i]). Invalid for sizes that differ, none or more than kMaxObservations of them,
/// parameters out of range, or an observation that is not finite or beyond 1e9. Stops a restart early once no mean
/// moves. Time: at most restarts * max_iterations passes over the points. Realtime-safe: yes.
Clusters cluster_points(const ClusterParams& params, std::span<const float> x, std::span<const float> y) WASP_REALTIME;

/// The same in plain loops: what the SIMD form must equal but for the order in which sums are rounded.
Clusters cluster_points_reference(const ClusterParams& params, std::span<const float> x,
                                  std::span<const float> y) WASP_REALTIME;

}  // namespace wasp::vision
