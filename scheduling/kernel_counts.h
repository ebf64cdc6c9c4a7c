// What the kernel has counted for a thread and for a core, read from /proc by the supervisor: who had the core while a
// real-time thread waited for it, where no trace of the scheduler is allowed.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "types/time.h"

namespace wasp::scheduling {

/// /proc/self/task/TID/schedstat.
struct ThreadCounts {
  DurationNs ran_ns = 0;        ///< on a core
  DurationNs run_delay_ns = 0;  ///< ready, and waiting for a core
  std::uint64_t slices = 0;     ///< times it was given a core
};

/// Empty where the kernel does not say or the thread is gone.
std::optional<ThreadCounts> thread_counts(int tid);

/// One line of /proc/stat, in clock ticks (usually 10 ms).
struct CoreCounts {
  static constexpr std::array kNames = {"user", "nice", "system", "idle", "iowait", "irq", "softirq", "steal"};
  std::array<std::uint64_t, kNames.size()> ticks{};
};

std::optional<CoreCounts> core_counts(int core);

/// Length of one of those ticks.
DurationNs core_tick_ns();

}  // namespace wasp::scheduling
