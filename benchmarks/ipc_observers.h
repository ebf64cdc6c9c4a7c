// What observers cost the writer: nothing, that is the claim. 0, 1, 4 and 8 processes copy every new frame, read-only.
#pragma once

#include "benchmarks/child.h"
#include "benchmarks/ipc_run.h"
#include "benchmarks/report.h"

namespace wasp::bench {

/// Measures for about `seconds` and reports the writer's publish time under each number of observers.
void measure_observers(Report& report, const Placement& placement, Run& run, double seconds);

}  // namespace wasp::bench
