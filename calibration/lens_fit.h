// A lens from views of a plane (Zhang 2000) by OpenCV, with what OpenCV does not say: the covariance of either lens'
// parameters, the error on views that were held out, and how well the ray of each pixel is known.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "types/camera.h"

namespace wasp::calibration {

struct LensModel {
  LensKind kind = LensKind::kPinhole;
  bool k3 = true;  ///< pinhole only
};

/// Common to all views, so that no scatter shows it: of the detector, the paper, the lens that is no polynomial.
inline constexpr double kCornerBias_px = 0.03;

using Corners = std::vector<cv::Point2f>;

/// What is known of one camera. Parameters in the order fx fy cx cy, then k1 k2 p1 p2 [k3] or k1 k2 k3 k4.
struct LensFit {
  LensModel model;
  cv::Matx33d K = cv::Matx33d::eye();
  std::vector<double> distortion;                ///< 5 (OpenCV order) or 4
  std::vector<cv::Vec3d> rotation, translation;  ///< board to camera, a view each (axis-angle; unit of the board)
  std::vector<Corners> residuals;                ///< seen - projected [px]
  std::vector<double> view_rms;                  ///< [px], of the distance
  double rms = 0;
  Eigen::MatrixXd covariance;  ///< of the parameters, from scatter
  Eigen::VectorXd sigma;       ///< one standard deviation: the largest of scatter, view by view, and jackknife
  Eigen::VectorXd bias;        ///< most that corners seen kCornerBias_px wrong, all in the worst pattern, would move it

  [[nodiscard]] Eigen::VectorXd parameters() const;
};

/// nullopt where OpenCV finds no solution.
std::optional<LensFit> fit_lens(const std::vector<cv::Point3f>& board, const std::vector<Corners>& views,
                                cv::Size image, const LensModel& model);

/// Fits without each of up to five blocks of neighbouring views, tried on the block: distance rms [px]. Raises
/// `fit.sigma` to what the fits differ by (delete-a-group jackknife). nullopt when a fit fails or too few views remain.
std::optional<double> cross_validate(const std::vector<cv::Point3f>& board, const std::vector<Corners>& views,
                                     cv::Size image, LensFit& fit);

/// One standard deviation of where the lens puts a ray [px], for the pixel `at`; NaN where the lens has no ray for it.
double projection_sigma(const LensFit& fit, cv::Point2d at);

/// Greatest angle between the board's normals of any two views [rad].
double widest_tilt(const LensFit& fit);

}  // namespace wasp::calibration
