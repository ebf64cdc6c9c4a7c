// A lens as a solution: keys of [camera], evidence, pictures over the image.
#pragma once

#include <string>
#include <vector>

#include "calibration/calibration.h"
#include "calibration/chessboard_views.h"
#include "calibration/lens_fit.h"

namespace wasp::calibration {

/// How much of the image has corners.
struct ImageCoverage {
  static constexpr int kColumns = 8, kRows = 6;
  int cells = 0;             ///< of kColumns x kRows that hold a corner
  double widest_radius = 0;  ///< of a corner from the principal point, share of the farthest image corner's
};
ImageCoverage image_coverage(const BoardViews& views, const LensFit& fit);

/// Parts of the image for whose centre the lens has no ray: beyond the corners its polynomial folds back.
int cells_without_ray(const BoardViews& views, const LensFit& fit);

/// What was tried and found beside the fit itself.
struct CameraEvidence {
  double held_out_rms_px = 0;
  double square_mm = 0;
  std::string section;
  std::vector<std::string> removed;  ///< views whose error stood out, "name (rms px)"
  std::vector<std::string> notes;
};

/// Size and lens as keys of the section `name`.
TomlSection camera_section(const BoardViews& views, const LensFit& fit, const std::string& name);

Solution camera_solution(const BoardViews& views, const LensFit& fit, const CameraEvidence& evidence,
                         const std::string& source);

}  // namespace wasp::calibration
