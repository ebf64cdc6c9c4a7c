// A picture of one core from the instant when all its threads are released together, drawn by playing the schedule.
#pragma once

#include <string>
#include <vector>

#include "scheduling/response_time.h"

namespace wasp::scheduling {

/// When a thread had the core: [start, end).
struct Slice {
  std::size_t thread = 0;
  DurationNs start_ns = 0, end_ns = 0;
};

/// Plays fixed-priority preemptive scheduling of one core for `length_ns`, every thread released at 0 and then once a
/// period, equal priorities first come first served (in table order at the same instant).
std::vector<Slice> play(const std::vector<AnalysedThread>& threads, DurationNs length_ns);

/// One line a thread, `columns` wide: '#' has the core, '-' waits for it, '^' (below) released, '.' nothing to do.
std::string schedule_picture(const std::vector<AnalysedThread>& threads, DurationNs length_ns, int columns = 72);

}  // namespace wasp::scheduling
