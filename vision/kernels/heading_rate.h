// Heading rate and height ratio from a camera that looks straight down (5.3): the image turns by minus the yaw, and
// grows by the inverse of the height ratio. Default: similarity fit to the flow grid, which lets the ground shift under
// the camera. The thesis' own way, phase correlation of log-polar maps, is heading_log_polar.h.
// Derivation: floor at height Z below a camera with flow f = (s e^(i theta) - 1) p + t: s = Z_k / Z_(k+1) ((5.6) is
// misprinted: d rho = -M d ln Z). The camera's z axis is down, so a yaw of psi (clockwise from above) turns the scene
// by -psi from x towards y.
#pragma once

#include "types/realtime.h"
#include "vision/kernels/similarity_fit.h"

namespace wasp::vision {

struct HeadingRate {
  bool valid = false;
  float yaw_rad = 0;             ///< heading change between the two frames, clockwise seen from above (NED)
  float height_ratio = 1;        ///< Z_(k+1) / Z_k; > 1: climbing
  float yaw_sigma_rad = 0;       ///< 1 sigma
  float height_ratio_sigma = 0;  ///< 1 sigma
};

/// From a fit. Invalid with it, and when a sigma exceeds `max_sigma` (rad, and relative). Realtime-safe: yes.
HeadingRate heading_from_fit(const SimilarityFit& fit, float max_sigma = 0.02f) WASP_REALTIME;

/// Vertical speed, up positive [m/s]: (ratio - 1) Z_k / dt, from the height at the first frame. 0 for an invalid
/// estimate or a step that is not positive. Realtime-safe: yes.
float climb_rate_mps(const HeadingRate& rate, float height_m, float step_s) WASP_REALTIME;

}  // namespace wasp::vision
