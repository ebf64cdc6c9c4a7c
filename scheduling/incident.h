// One missed deadline with everything known of it: what the thread saw, what ran instead, the last events of every
// thread. Readable text, and the same as one line of JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scheduling/kernel_counts.h"
#include "scheduling/switch_trace.h"
#include "scheduling/thread_watch.h"

namespace wasp::scheduling {

/// A thread's part of the window in which the miss fell.
struct IncidentThread {
  std::string name;
  int core = 0, priority = 0, tid = 0;
  bool demoted = false;
  std::optional<ThreadCounts> counts;  ///< within the window
  std::vector<rt::TraceEvent> events;  ///< oldest first
};

struct Incident {
  int number = 1, limit = 1;
  std::string instance, wall_time;
  std::string thread;  ///< that missed
  int core = 0, priority = 0;
  bool real_time = true;
  Miss miss;
  std::uint64_t more = 0;                 ///< further misses of any thread while this one was looked at
  DurationNs window_ns = 0;               ///< between the supervisor's two looks at the kernel's counts
  std::optional<CoreCounts> core_counts;  ///< within the window
  std::string trace_why_not;              ///< empty: `shares` is the kernel's own trace
  std::vector<CoreShare> shares;          ///< of the core, from `shares_from_ns` to `shares_to_ns`
  TimeNs shares_from_ns = 0, shares_to_ns = 0;
  std::vector<IncidentThread> threads;
};

const char* name_of(MissKind kind) noexcept;
/// The first line: thread, tick, lateness, involuntary switches.
std::string incident_headline(const Incident& incident);
std::string incident_text(const Incident& incident);
std::string incident_json(const Incident& incident);

}  // namespace wasp::scheduling
