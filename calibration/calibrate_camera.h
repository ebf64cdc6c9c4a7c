// `wasp calibrate camera`: intrinsics and distortion of a pinhole or a fisheye lens from images of a chessboard.
#pragma once

#include <string>

#include "calibration/calibration.h"

namespace wasp::calibration {

struct CameraOptions {
  std::string folder;
  std::string board = "auto";    ///< "9x6": inner corners
  double square_mm = 25;         ///< scales the poses only; intrinsics do not depend on it
  std::string lens = "pinhole";  ///< pinhole | fisheye | auto: the one with the smaller error on held-out views
  std::string k3 = "auto";       ///< auto: where it makes held-out views better; on; off
  std::string section = "camera";
  int most_views = 60;
};

/// Throws Refusal.
Solution solve_camera(const CameraOptions& options, ProgressBar& bar);

std::function<Solution(ProgressBar&)> prepare_camera(CLI::App& app);

}  // namespace wasp::calibration
