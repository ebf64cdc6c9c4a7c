// `wasp bench latency`.
#pragma once

#include "benchmarks/latency_options.h"

namespace wasp::bench {

/// 0: measured, every bar that applies met; 1: a bar was missed; 2: could not measure.
int run_latency(const LatencyOptions& options);
int run_contract(const LatencyOptions& options);

}  // namespace wasp::bench
