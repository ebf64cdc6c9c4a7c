#include "benchmarks/latency_data.h"

#include <algorithm>
#include <iterator>

namespace wasp::bench {

std::vector<Tick> ticks_between(const std::vector<Tick>& ticks, TimeNs from_ns, TimeNs to_ns) {
  std::vector<Tick> inside;
  std::copy_if(ticks.begin(), ticks.end(), std::back_inserter(inside),
               [&](const Tick& t) { return t.value.due_at_ns >= from_ns && t.value.due_at_ns <= to_ns; });
  return inside;
}

std::vector<tools::Wakeup> control_wakeups(const std::vector<Tick>& ticks) {
  std::vector<tools::Wakeup> wakeups;
  wakeups.reserve(ticks.size());
  for (const Tick& t : ticks)
    wakeups.push_back({t.value.due_at_ns, t.value.released_at_ns - t.value.due_at_ns, t.at_ns});
  return wakeups;
}

}  // namespace wasp::bench
