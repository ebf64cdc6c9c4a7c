// `wasp plan`: the thread table of a configuration, analysed and drawn, without flying.
#pragma once

#include "scheduling/behaviour_row.h"

namespace wasp::scheduling {

/// Exit code 0: schedulable; 1: not, or the configuration is in error; 2: bad arguments.
int plan_main(const BehaviourTable& behaviours, int argc, char** argv);

}  // namespace wasp::scheduling
