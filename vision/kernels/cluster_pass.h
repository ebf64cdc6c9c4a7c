// One pass of Lloyd's algorithm: every point to its nearest mean, and the sums the next means come from.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "types/realtime.h"
#include "vision/kernels/cluster.h"

namespace wasp::vision {

struct ClusterPoints {
  std::size_t count = 0;
  alignas(64) std::array<float, kMaxObservations> x{}, y{};
};

struct ClusterMeans {
  int count = 0;  ///< 1 ... kMaxClusters
  std::array<float, kMaxClusters> x{}, y{};
  friend bool operator==(const ClusterMeans&, const ClusterMeans&) = default;
};

struct ClusterPass {
  float compactness = 0;
  std::array<float, kMaxClusters> size{}, sum_x{}, sum_y{};
  alignas(64) std::array<std::int32_t, kMaxObservations> label{};
  alignas(64) std::array<float, kMaxObservations> distance2{};  ///< to the nearest mean
};

/// Equal distances go to the mean of lower index. Realtime-safe: yes.
void cluster_pass_reference(const ClusterPoints& points, const ClusterMeans& means, ClusterPass& out) WASP_REALTIME;
/// The same in SIMD; sums are rounded in another order. Realtime-safe: yes.
void cluster_pass_simd(const ClusterPoints& points, const ClusterMeans& means, ClusterPass& out) WASP_REALTIME;

}  // namespace wasp::vision
