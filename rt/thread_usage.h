// What the kernel has counted for the calling thread: page faults (in a real-time loop they must stay zero) and context
// switches (an involuntary one means that something else took the core).
#pragma once

#include <sys/resource.h>

#include <cstdint>

#include "rt/contract.h"

namespace wasp::rt {

struct ThreadUsage {
  std::int64_t minor_faults = 0, major_faults = 0;
  std::int64_t voluntary_switches = 0;    ///< it slept
  std::int64_t involuntary_switches = 0;  ///< it was preempted
};

constexpr ThreadUsage operator-(const ThreadUsage& a, const ThreadUsage& b) WASP_REALTIME {
  return {a.minor_faults - b.minor_faults, a.major_faults - b.major_faults, a.voluntary_switches - b.voluntary_switches,
          a.involuntary_switches - b.involuntary_switches};
}

/// Realtime-safe: yes (getrusage).
inline ThreadUsage thread_usage() WASP_REALTIME {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt, usage.ru_majflt, usage.ru_nvcsw, usage.ru_nivcsw};
}

}  // namespace wasp::rt
