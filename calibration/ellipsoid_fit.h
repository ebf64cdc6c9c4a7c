// The ellipsoid of a three-axis sensor that is turned through many orientations: neutral m0 and matrix K such that
// |K (m - m0)| is constant (thesis A.1 - A.3: K diagonal; here also symmetric, with cross-axis terms, and with neutrals
// that drift with temperature). Start: least median of squares over algebraic fits of few samples, which up to half the
// samples being wrong cannot move far. Then Gauss-Newton (Levenberg-Marquardt) on the geometric residual
// |K (m - m0)| - norm with Tukey's weights, and once more without what lies beyond four standard deviations.
//
// (A.3) of the thesis misses a square: it is norm^2 that the sum of squares equals.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace wasp::calibration {

struct EllipsoidModel {
  bool cross_axis = false;   ///< 9 parameters instead of 6
  bool temperature = false;  ///< and three slopes of the neutral [unit per degree Celsius]
  [[nodiscard]] int parameters() const { return 6 + (cross_axis ? 3 : 0) + (temperature ? 3 : 0); }
};

/// One reading; `group` are readings whose errors belong together (a direction, a rest), for the uncertainty.
struct EllipsoidSample {
  Eigen::Vector3d value;
  double temperature_degc = 0;
  int group = 0;
};

struct Ellipsoid {
  EllipsoidModel model;
  double norm = 1;
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();  ///< symmetric; norm unit per sample unit
  Eigen::Vector3d neutral = Eigen::Vector3d::Zero();
  Eigen::Vector3d neutral_per_degc = Eigen::Vector3d::Zero();
  double at_degc = 0;  ///< temperature where `neutral` holds

  /// One standard deviation each; the larger of what scatter and what groups of samples show.
  Eigen::Matrix3d K_sigma = Eigen::Matrix3d::Zero();
  Eigen::Vector3d neutral_sigma = Eigen::Vector3d::Zero();
  Eigen::Vector3d neutral_per_degc_sigma = Eigen::Vector3d::Zero();
  Eigen::MatrixXd covariance;  ///< of neutral (sample units), K (xx yy zz, then xy xz yz), slopes

  double residual_rms = 0;  ///< of the samples used [norm unit]
  /// Smallest eigenvalue of the mean normal matrix in units of the norm; 2/15 where directions cover the sphere evenly.
  double least_eigenvalue = 0;
  std::vector<bool> used;  ///< per sample: false for an outlier
  std::size_t used_count = 0;

  [[nodiscard]] Eigen::Vector3d corrected(const Eigen::Vector3d& value, double temperature_degc) const {
    return K * (value - neutral - neutral_per_degc * (temperature_degc - at_degc));
  }
};

/// `noise` is a lower bound of one reading's standard deviation in norm units, known from elsewhere (0: none), for fits
/// with few samples to spare. nullopt where no ellipsoid fits at all. Realtime-safe: no. Deterministic.
std::optional<Ellipsoid> fit_ellipsoid(const std::vector<EllipsoidSample>& samples, const EllipsoidModel& model,
                                       double norm, double noise);

}  // namespace wasp::calibration
