// Flow on the left of the heading against flow on its right, made comparable: the azimuths are cut into bins, each bin
// gives a median, and only bins that both sides have enter, so that a side with other cells than its opposite does not
// look faster or slower for that.
#pragma once

#include "types/realtime.h"
#include "vision/kernels/level_flow.h"

namespace wasp::vision {

/// What of a cell is compared. kNearness: azimuth rate / sin(azimuth) = speed over horizontal distance [1/s] for a
/// vehicle that moves along its heading. kImageSpeed: the azimuth rate itself, outwards positive [rad/s].
enum class SideMeasure : std::uint8_t { kNearness, kImageSpeed };

struct SideParams {
  SideMeasure measure = SideMeasure::kNearness;
  float least_azimuth_rad = 0.26f, greatest_azimuth_rad = 1.3f;  ///< of the wedges, either side of the heading
  float greatest_elevation_rad = 0.30f;  ///< of cells that count, up or down: more would be floor and ceiling
  int min_cells = 5;                     ///< on each side, in bins that both sides have
};

struct SideBalance {
  bool valid = false;
  float left = 0, right = 0;             ///< [1/s] or [rad/s], outwards positive
  float mean_cosine = 0, mean_sine = 0;  ///< of the azimuths that entered
  int cells_left = 0, cells_right = 0;
};

/// Invalid if the flow is, for parameters out of range, or with too few cells on a side. Realtime-safe: yes.
SideBalance side_balance(const SideParams& params, const LevelFlow& flow) WASP_REALTIME;

}  // namespace wasp::vision
