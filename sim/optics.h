// What a simulated camera's lens and shutter do to the image; the geometry itself is types/camera.h.
#pragma once

#include <numbers>

#include "types/camera.h"

namespace wasp::sim {

struct OpticsParams {
  /// Full angle of the lens' image circle, 10 ... 220 degrees; pixels beyond it are black and have no depth. A pinhole
  /// never sees as much as 180 degrees.
  float field_of_view_rad = std::numbers::pi_v<float>;
  bool antialias = true;  ///< four rays for a pixel on an edge
  float focus_m = 2;      ///< distance of the plane in focus, >= 0.05
  float aperture_m = 0;   ///< diameter of the entrance pupil, 0 ... 0.05; 0: everything is in focus
  float exposure_s = 0;   ///< how long the shutter is open, 0 ... 0.1; 0: no motion blur
};

/// One camera: where it sits, its lens, its optics.
struct CameraSetup {
  CameraGeometry geometry;
  OpticsParams optics;
};

}  // namespace wasp::sim
