// The turn that keeps clear of what the map knows: a few dozen plans "head there for a while, then that way", each
// flown ahead with the vehicle's own lags through things that move on as they do, the cheapest taken; the next field
// decides anew. A vector field histogram (Borenstein and Koren 1991) knows only directions; a vehicle that takes a
// third of a second to begin a turn, and drifts through it, must know where it will really pass. Fixed trip counts.
#pragma once

#include "types/realtime.h"
#include "vision/kernels/obstacle_map.h"

namespace wasp::vision {

struct PathParams {
  float half_width_m = 0.3f;     ///< of the vehicle
  float margin_m = 0.15f;        ///< a straight path that leaves less than this is "in the way"
  float comfort_m = 0.3f;        ///< clearance beyond which more is of no use
  float first_s = 1.1f;          ///< how long a plan's first heading is flown
  float delay_s = 0.12f;         ///< from exposure to the command's effect
  float yaw_lag_s = 0.3f;        ///< of the yaw rate
  float drift_s = 0.7f;          ///< time in which sideways velocity is braked
  float heading_gain_1ps = 2.f;  ///< yaw rate over heading error, in the plans and in the wish
  float max_rate_radps = 0.7f;
};

/// How the vehicle moves now.
struct PathStart {
  float speed_mps = 0, yaw_rate_radps = 0;
  float travel_rad = 0;  ///< direction of travel, clockwise from the heading
};

struct PathChoice {
  bool in_way = false;                ///< something is on the straight path, and `rate_radps` leads around it
  bool stuck = false;                 ///< every plan comes too near
  float rate_radps = 0;               ///< wish, clockwise
  float first_rad = 0, then_rad = 0;  ///< headings of the plan, from the present one
  float clearance_m = 0;              ///< least, of the plan taken: distance to things less half_width
  float straight_clearance_m = 0;     ///< and of flying straight on
};

/// `last_first_rad`: the plan taken before, kept when there is little between it and a better one. Realtime-safe: yes.
PathChoice free_path(const PathParams& params, const ObstacleMap& map, const PathStart& start,
                     float last_first_rad) WASP_REALTIME;

}  // namespace wasp::vision
