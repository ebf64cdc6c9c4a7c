// `wasp calibrate kinect-extrinsics`: lenses of a Kinect's RGB and infrared camera and how they stand to each other, from
// pairs of images of one chessboard (thesis A.3.2.1, table A.3).
#pragma once

#include "calibration/calibration.h"

namespace wasp::calibration {

struct KinectPairOptions {
  std::string folder;
  std::string board = "auto";
  double square_mm = 0;  ///< required: the translation is in its unit
  std::string camera = "rgb";
};

/// Throws Refusal; `bar` is shown.
Solution solve_kinect_pair(const KinectPairOptions& options, ProgressBar& bar);

std::function<Solution(ProgressBar&)> prepare_kinect_pair(CLI::App& app);

}  // namespace wasp::calibration
