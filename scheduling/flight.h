// The flying process: config -> shared memory -> drivers -> thread table -> run -> land -> say what happened.
#pragma once

#include "scheduling/behaviour_row.h"

namespace wasp::scheduling {

/// `wasp flight`: parses its command line and flies. Exit codes: scheduling/flight_options.cpp, its --help.
int flight_main(const BehaviourTable& behaviours, int argc, char** argv);

}  // namespace wasp::scheduling
