// Faults of the control thread, in the middle of a tick: control.stall and control.spin.
#pragma once

#include "scheduling/control_loop.h"

namespace wasp::scheduling {

/// The hook that holds a tick up while one of them is on; `control` has a board and outlives the loop.
ControlHook control_fault_hook(LoopControl& control);

}  // namespace wasp::scheduling
