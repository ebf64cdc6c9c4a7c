// Deadline misses and skipped releases, and who is to blame. A miss is host noise if the time during which a thread of
// higher priority on the same core was itself not run explains it: had control had that time, it would have met its
// deadline. Threads below control prove nothing, for control itself may have kept them waiting. A miss that the witness
// above did not feel, though control was not even woken, was made by another real-time thread on the core.
#pragma once

#include <string>
#include <vector>

#include "benchmarks/latency_data.h"

namespace wasp::bench {

struct Miss {
  TimeNs due_at_ns = 0;
  DurationNs late_ns = 0;  ///< due to the command's last byte, or to the end of the work that swallowed it
  bool skipped = false;    ///< the release was never served
  DurationNs host_ns = 0;  ///< of that, time in which the references above control were not run either
  bool host_noise = false;
  bool woken_late = false;                  ///< the delay lay before control ran at all
  [[nodiscard]] const char* cause() const;  ///< in words
};

/// Time within [from, to] covered by the delays [due, due + late] of any of `references`; overlaps count once.
DurationNs stalled_ns(const std::vector<const std::vector<tools::Wakeup>*>& references, TimeNs from_ns, TimeNs to_ns);

/// In time. `ticks` on one grid, as seen; gaps that no delay explains (lost by the observer) are not misses.
std::vector<Miss> find_misses(const std::vector<Tick>& ticks, const FlightTimes& times,
                              const std::vector<const std::vector<tools::Wakeup>*>& trusted);

/// The references of a pair that may be trusted: above control.
std::vector<const std::vector<tools::Wakeup>*> trusted_references(const PairData& pair);

}  // namespace wasp::bench
