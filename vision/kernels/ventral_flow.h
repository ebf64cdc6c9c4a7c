// Translation over height from the flow of the ground below. With a ground point at (X, Y, 1) h in level axes (x along
// the heading, y right, z down), a camera that moves at (vx, vy) over ground and sinks at vd sees
//     X' = -vx/h + X vd/h,   Y' = -vy/h + Y vd/h,
// three unknowns, two rows from each cell, solved robustly.
#pragma once

#include "types/realtime.h"
#include "vision/kernels/level_flow.h"

namespace wasp::vision {

struct VentralParams {
  float half_angle_rad = 0.6f;  ///< of the cone about straight down whose cells take part, at most 1.2
  int min_cells = 8;
  float max_sigma_radps = 0.25f;  ///< a less certain flow is none
};

struct VentralFlow {
  bool valid = false;
  float forward_radps = 0, right_radps = 0;  ///< vx/h and vy/h: the flow straight below
  float sinking_1ps = 0;                     ///< vd/h
  float sigma_radps = 0;                     ///< of forward and right, one standard deviation
  int cells = 0;
};

/// Invalid if the flow is, with fewer than min_cells cells in the cone, or too uncertain. Realtime-safe: yes.
VentralFlow ventral_flow(const VentralParams& params, const LevelFlow& flow) WASP_REALTIME;

}  // namespace wasp::vision
