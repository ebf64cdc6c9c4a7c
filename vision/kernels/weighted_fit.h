// Robust least squares in a few unknowns: rows a . x = b, Tukey's biweight on the median residual, fixed rounds.
#pragma once

#include <Eigen/Cholesky>
#include <array>
#include <cmath>

#include "types/realtime.h"
#include "vision/kernels/flow_points.h"

namespace wasp::vision {

/// At most `kRows` rows in `N` unknowns. No heap.
template <int N, int kRows>
struct WeightedFit {
  using Unknowns = Eigen::Matrix<float, N, 1>;
  std::array<Unknowns, kRows> a;
  std::array<float, kRows> b, weight;
  int count = 0;
  float residual = 0;  ///< median absolute, of the last round

  /// Ignored when full or not finite. Realtime-safe: yes.
  void add(const Unknowns& row, float value) WASP_REALTIME {
    if (count == kRows || !row.allFinite() || !std::isfinite(value)) return;
    const auto k = static_cast<std::size_t>(count++);
    a[k] = row;
    b[k] = value;
  }

  /// `ridge` > 0 pulls unknowns that the rows do not determine to 0; `floor` is the least credible residual. False if
  /// there are fewer rows than unknowns or the result is not finite. Realtime-safe: yes.
  bool solve(float ridge, float floor, Unknowns& x) WASP_REALTIME {
    constexpr int kRounds = 4;
    x.setZero();
    if (count < N) return false;
    weight.fill(1.f);
    for (int round = 0; round < kRounds; ++round) {
      Eigen::Matrix<float, N, N> normal = Eigen::Matrix<float, N, N>::Identity() * ridge;
      Unknowns right = Unknowns::Zero();
      for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
        normal += weight[k] * a[k] * a[k].transpose();
        right += weight[k] * b[k] * a[k];
      }
      x = normal.ldlt().solve(right);
      if (!x.allFinite()) return false;
      reweight(x, floor);
    }
    return true;
  }

 private:
  void reweight(const Unknowns& x, float floor) WASP_REALTIME {
    std::array<float, kRows> off;
    const auto n = static_cast<std::size_t>(count);
    for (std::size_t k = 0; k < n; ++k) off[k] = std::abs(a[k].dot(x) - b[k]);
    std::array<float, kRows> sorted = off;
    residual = median_in_place({sorted.data(), n});
    const float limit = kBiweightSigmas * 1.4826f * (residual > floor ? residual : floor);
    for (std::size_t k = 0; k < n; ++k) weight[k] = biweight(off[k] * off[k], limit);
  }
};

}  // namespace wasp::vision
