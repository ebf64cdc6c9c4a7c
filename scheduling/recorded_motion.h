// A script for the behaviours from what was recorded beside the frames of any layout, so that a replay gives them the
// attitude the camera had.
#pragma once

#include "drivers/recording.h"
#include "scheduling/replay_script.h"

namespace wasp::scheduling {

/// Attitude at each frame's time (motion capture or the like) and mean specific force since the frame before, body axes
/// of the camera's mount. Every frame has a step; empty if no frame has an attitude.
BehaviourScript script_of(const drivers::Recording& recording);

}  // namespace wasp::scheduling
