// How a Kinect's two cameras stand to each other, from chessboards that both saw: each camera's lens by itself
// (lens_fit.h), then rotation and translation from one to the other by stereo calibration with both lenses fixed.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calibration/chessboard_views.h"
#include "calibration/lens_fit.h"

namespace wasp::calibration {

/// Views of one board by both cameras at the same time, in the same order.
struct BoardPairs {
  BoardViews rgb, ir;
};

struct PairFit {
  LensFit rgb, ir;
  cv::Matx33d R = cv::Matx33d::eye();         ///< ir to rgb: p_rgb = R p_ir + T
  cv::Vec3d T_mm;                             ///< unit of the board
  double rms_px = 0;                          ///< of all corners in both images
  std::vector<double> pair_rms_px;            ///< a pair each
  cv::Vec3d T_sigma_mm, rotation_sigma_rad;   ///< one standard deviation of the result (delete-a-group jackknife)
};

/// nullopt where OpenCV finds no solution. Needs as many views on either side.
std::optional<PairFit> fit_pairs(const BoardPairs& pairs, double square_mm, bool k3);

}  // namespace wasp::calibration
