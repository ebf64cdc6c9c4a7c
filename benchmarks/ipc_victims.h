// What a killed or a frozen reader does to the writer and to the other readers: nothing, that is the claim.
#pragma once

#include "benchmarks/child.h"
#include "benchmarks/ipc_run.h"
#include "benchmarks/report.h"

namespace wasp::bench {

/// Measures for about `seconds`: the writer's publish time while a second woken reader is killed and frozen at random,
/// against the same with that reader spared and a process that does not read killed and frozen in its place; and the
/// frames the first reader lost.
void measure_victims(Report& report, const Placement& placement, Run& run, double seconds);

}  // namespace wasp::bench
