// The list of behaviours: every program that flies, in real time or in lockstep, has this one.
#pragma once

#include "scheduling/behaviour_row.h"

namespace wasp {

/// In the order of Cue::behaviour. A new behaviour is one file pair in vision/, one row in behaviours.cpp, and one
/// section in config/wasp.toml.
const scheduling::BehaviourTable& all_behaviours();

}  // namespace wasp
