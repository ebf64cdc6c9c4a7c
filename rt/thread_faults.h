// Page faults of the calling thread since a mark: in a real-time loop both numbers must stay zero.
#pragma once

#include <sys/resource.h>

#include <cstdint>

#include "rt/contract.h"

namespace wasp::rt {

struct FaultCount {
  std::int64_t minor = 0, major = 0;
};

/// Realtime-safe: yes (getrusage).
inline FaultCount thread_faults() WASP_REALTIME {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt, usage.ru_majflt};
}

}  // namespace wasp::rt
