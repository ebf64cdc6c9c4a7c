// `wasp calibrate kinect-depth`: the three depth models of a Kinect from raw readings of a wall at known distances
// (thesis A.3.2.1); the one that tells held-out distances best is for the flight.
#pragma once

#include "calibration/calibration.h"
#include "calibration/kinect_depth_fit.h"

namespace wasp::calibration {

struct KinectDepthOptions {
  std::string table;
  std::string model = "auto";  ///< auto | two-gaussians | tangent | linear
  double part = 0.2;           ///< of an image's width and height
  KinectNoise noise;
};

/// Throws Refusal; `bar` is shown.
Solution solve_kinect_depth(const KinectDepthOptions& options, ProgressBar& bar);

std::function<Solution(ProgressBar&)> prepare_kinect_depth(CLI::App& app);

}  // namespace wasp::calibration
