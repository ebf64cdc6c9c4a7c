#include "tools/wakeups.h"

#include <algorithm>

namespace wasp::tools {

Population whole_population(const std::vector<Wakeup>& served, DurationNs period_ns) {
  Population all;
  all.late_ns.reserve(served.size());
  for (std::size_t i = 0; i < served.size(); ++i) {
    const Wakeup& w = served[i];
    all.late_ns.push_back(w.late_ns);
    if (i + 1 == served.size()) break;
    const TimeNs back_at_ns = std::max(w.busy_until_ns, w.due_at_ns + w.late_ns);
    // Half a period of tolerance: a grid that drifts by nanoseconds must not make a release of its own.
    for (TimeNs due = w.due_at_ns + period_ns; due < served[i + 1].due_at_ns - period_ns / 2; due += period_ns) {
      if (back_at_ns <= due) {
        ++all.unobserved;
        continue;
      }
      all.late_ns.push_back(back_at_ns - due);
      ++all.skipped;
    }
  }
  return all;
}

}  // namespace wasp::tools
