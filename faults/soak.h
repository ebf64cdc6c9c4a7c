// The soak: one long flight in real time, faults of the catalogue at random, one after the other; memory, descriptors,
// threads and latency of the flight must end as they began.
#pragma once

#include <filesystem>
#include <functional>

#include "faults/flight_plan.h"

namespace wasp::faults {

struct SoakOptions {
  double seconds = 1800;
  std::uint32_t seed = 1;
  std::filesystem::path out = "out/faults";
};

/// Flies, prints a line a sample and the comparison of first and last quarter, writes samples to OUT/soak.csv. Exit
/// code: 0 everything is flat and the flight goes on; 1 not; 4 interrupted.
int run_soak(const SoakOptions& options, const Abilities& abilities, const std::function<bool()>& interrupted);

}  // namespace wasp::faults
