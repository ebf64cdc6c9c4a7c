// A straight line with a drift, fitted so that wrong points do not move it: y = offset + slope x [+ drift t].
#pragma once

#include <array>
#include <vector>

namespace wasp::calibration {

struct LinePoint {
  double x = 0, y = 0;
  double t = 0;  ///< seconds; used when a drift is asked for
};

struct RobustLine {
  double offset = 0, slope = 0, drift = 0;
  double offset_sigma = 0, slope_sigma = 0, drift_sigma = 0;
  double residual_rms = 0;  ///< of the points used
  std::vector<bool> used;   ///< false: beyond four robust standard deviations
  std::size_t used_count = 0;
  [[nodiscard]] double at(const LinePoint& p) const { return offset + slope * p.x + drift * p.t; }
};

/// Start: the median of slopes of pairs (Theil and Sen); then least squares on what lies within four robust deviations
/// of it (never less than `least_sigma`). Needs three points, four with a drift; x of some must differ.
RobustLine fit_line(const std::vector<LinePoint>& points, bool with_drift, double least_sigma);

}  // namespace wasp::calibration
