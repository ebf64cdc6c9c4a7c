// The one constant of the heading rate behaviour (thesis section 4): true over seen turn, on a run in which the vehicle
// turns about its vertical, a turntable or by hand, over a floor. The behaviour's own step sees; a gyro (or motion
// capture) knows. Both have noise, so the slope lies between those of the two regressions; it is taken at their
// geometric mean and half their distance counts as uncertainty.
#pragma once

#include <string>
#include <vector>

#include "calibration/turn_source.h"
#include "drivers/recording.h"

namespace wasp::calibration {

/// What the behaviour said between two frames.
struct SeenYaw {
  TimeNs first_ns = 0, second_ns = 0;
  bool valid = false;
  double yaw_radps = 0;                                 ///< clockwise from above, with scale 1
  Eigen::Vector3d down_cam = Eigen::Vector3d::UnitZ();  ///< the world's down at the second frame, as far as is known
};

/// Runs flow grid and behaviour over the grey frames; attitude from the recording where it has it, else level.
/// `stamps` are those of the entries.
std::vector<SeenYaw> seen_yaw(const drivers::Recording& recording, const std::vector<TimeNs>& stamps);

struct HeadingScaleParams {
  int least_pairs = 60;
  double least_rms_radps = 0.1;  ///< of the true yaw rate about its mean
  double least_each_way = 0.1;   ///< share of the pairs that turn each way faster than a third of the rms
  double least_correlation = 0.98;
  double most_sigma = 0.01;
  double least_valid = 0.5;
};

struct HeadingScale {
  double scale = 1, sigma = 0;
  double low = 0, high = 0;  ///< slopes of the two regressions
  double bias_radps = 0;     ///< of the gyro
  double correlation = 0, residual_radps = 0, rms_radps = 0, valid_share = 0;
  std::size_t pairs = 0, outliers = 0;
  std::vector<double> time_s, seen_radps, known_radps, residuals_radps;
  std::string refusal;
  [[nodiscard]] bool ok() const { return refusal.empty(); }
};

/// `delay_s` is taken off the frames' stamps.
HeadingScale fit_heading_scale(const std::vector<SeenYaw>& seen, const TurnSource& source, double delay_s,
                               const HeadingScaleParams& params = {});

}  // namespace wasp::calibration
