// A Kinect's depth model from raw readings of known distances: weighted least squares by Levenberg and Marquardt. An
// error of the tape is the same at every distance, one of the reading grows with the square of it: each counts by what
// both together are worth. The Gaussians are fitted as exponentials of parabolas, which at least has a scale; their
// printed coefficients are anything but determined, the curve is.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "drivers/kinect_depth.h"

namespace wasp::calibration {

/// Readings at one distance.
struct KinectPoint {
  double raw = 0, distance_m = 0;
  std::string name;  ///< row or file, for messages
};

struct KinectNoise {
  double raw_steps = 0.4;  ///< of a point's raw value, one standard deviation
  double tape_m = 0.003;   ///< of its distance
};

struct KinectDepthFit {
  drivers::KinectDepthModel model;  ///< range: what the points cover
  std::vector<double> residual_m;   ///< model minus distance, a point each
  double rms_m = 0, rms_share = 0;  ///< share: of the distance
  double held_out_share = 0;        ///< rms of points that the fit did not see
  double chi2_per_freedom = 0;      ///< 1: errors as large as KinectNoise says
  Eigen::MatrixXd covariance;       ///< of `parameters`
  Eigen::VectorXd parameters;       ///< scaled, see the source

  /// One standard deviation of the model's depth at a raw value [m].
  [[nodiscard]] double sigma_m(double raw) const;
  /// The greatest share of the depth that sigma is, between the nearest and the farthest point.
  [[nodiscard]] double worst_sigma_share(const std::vector<KinectPoint>& points) const;
};

/// nullopt where it does not converge to finite depths. Needs more points than coefficients. Deterministic.
std::optional<KinectDepthFit> fit_kinect_depth(drivers::KinectModel kind, const std::vector<KinectPoint>& points,
                                               const KinectNoise& noise);

}  // namespace wasp::calibration
