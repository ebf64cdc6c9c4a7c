// A boxy person who walks a beat: to and fro between two points along x, turning about at either end, for ever.
#pragma once

#include "sim/random.h"
#include "sim/world.h"

namespace wasp::sim {

struct Beat {
  float from_x_m = 0, to_x_m = 1;  ///< from < to
  float y_m = 0;
  float speed_mps = 0.6f;  ///< > 0
  float start_share = 0;   ///< where between the ends the walk begins at time 0, 0 ... 1 exclusive
  bool towards_to = true;  ///< which way it begins
  float turn_yaw_rad = 1;  ///< what is faced half-way through turning about: +-pi/2
};

inline constexpr float kWalkerWidth_m = 0.45f;

/// Adds the figure, 1.6 to 1.85 m tall, as a moving part called `name`.
void add_walker(World& world, const std::string& name, const Beat& beat, Random& random);

}  // namespace wasp::sim
