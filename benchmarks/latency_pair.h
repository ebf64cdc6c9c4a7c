// One pair: a flight in the simulator, the load, cyclictest on control's core at the next priority and the same period,
// and a witness of our own above everybody. cyclictest's grid lies 0.25 ms behind control's in one half of a pair and
// as much before it in the other, never on it, so that both see the same moment of the machine and neither waits for
// the other. The priority alternates from pair to pair, and each pair is a new flight: no chance phase decides.
#pragma once

#include <functional>

#include "benchmarks/latency_data.h"
#include "benchmarks/latency_options.h"
#include "scheduling/config.h"

namespace wasp::bench {

/// Told now and then: seconds measured so far in this pair, and control's latest wake-up latency [ns].
using PairProgress = std::function<void(double seconds, std::int64_t late_ns)>;

/// Which order and priority pair `index` has.
PairSetup setup_of(const std::string& load, int index, const scheduling::Config& config);

/// Throws std::runtime_error if flight, load or reference fail.
PairData run_pair(PairSetup setup, const LatencyOptions& options, const scheduling::Config& config,
                  const PairProgress& progress);

}  // namespace wasp::bench
