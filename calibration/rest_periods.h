// Where a sensor lay still: windows whose scatter is near the least of the record and whose mean does not drift, joined
// while their means agree. Medians throughout: a spike costs a reading, not the window.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/samples.h"

namespace wasp::calibration {

struct RestOptions {
  double window_s = 0.5;       ///< least length of a rest
  int window_samples = 40;     ///< where nothing tells the time
  double quiet_factor = 3;     ///< scatter up to this many times the least of the record is rest
  double most_scatter = 0.05;  ///< ... and never above this share of the typical reading: then it never lay still
  double most_drift = 0.004;   ///< between the halves of a window, share of the typical reading
};

struct RestPeriod {
  std::size_t first = 0, count = 0;  ///< samples
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_of_mean = Eigen::Vector3d::Zero();  ///< readings taken as independent
  double temperature_degc = 0;
};

/// In the order of the record. `typical` is the size readings are compared with (for an accelerometer about one g in
/// the samples' unit; 0: the median norm about zero).
std::vector<RestPeriod> find_rests(const Samples& samples, const RestOptions& options, double typical);

/// Median and standard deviation by the median absolute deviation, per axis; quantisation counts as noise.
struct RobustMoments {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();  ///< of the readings within four deviations of the median
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();
};
RobustMoments robust_moments(const std::vector<Eigen::Vector3d>& values, std::size_t first, std::size_t count);

}  // namespace wasp::calibration
