// Wake-ups of a periodic thread, and the population they stand for. A release that fell due while the thread was late
// or busy was never served, yet somebody waited for it: it enters the population with the time from its own intended
// instant to the end of the delay (no coordinated omission: Tene, "How NOT to measure latency", 2013).
#pragma once

#include <cstdint>
#include <vector>

#include "types/time.h"

namespace wasp::tools {

struct Wakeup {
  TimeNs due_at_ns = 0;           ///< intended release on the grid
  DurationNs late_ns = 0;         ///< thread running minus due
  TimeNs busy_until_ns = kNever;  ///< when its work was done; kNever: not known, it had none
};

struct Population {
  std::vector<std::int64_t> late_ns;  ///< one a release, served or skipped
  std::size_t skipped = 0;            ///< releases in it that nobody served
  std::size_t unobserved = 0;         ///< gaps no delay explains: samples the observer lost, not counted as latencies
};

/// `served` rising in time on a grid of `period_ns` > 0.
Population whole_population(const std::vector<Wakeup>& served, DurationNs period_ns);

}  // namespace wasp::tools
