// Wind: a mean and gusts about it, each component an Ornstein-Uhlenbeck process. The same everywhere, and the same for
// the same seed.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "sim/random.h"

namespace wasp::sim {

struct WindParams {
  double mean_mps = 0;
  double from_rad = 0;     ///< where the mean wind comes from, from north towards east
  double gust_mps = 0;     ///< standard deviation, north and east each; half of it vertically
  double gust_time_s = 2;  ///< correlation time, > 0
};

class Wind {
 public:
  Wind(const WindParams& params, std::uint32_t seed);

  /// `dt_s` later. Exact for any step.
  void step(double dt_s);
  [[nodiscard]] const Eigen::Vector3d& velocity_ned_mps() const { return velocity_; }
  [[nodiscard]] bool blows() const { return params_.mean_mps > 0 || params_.gust_mps > 0; }

 private:
  WindParams params_;
  Random random_;
  Eigen::Vector3d mean_, deviation_, gust_ = Eigen::Vector3d::Zero(), velocity_;
};

}  // namespace wasp::sim
