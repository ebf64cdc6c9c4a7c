#include "benchmarks/latency_misses.h"

#include <algorithm>
#include <utility>

namespace wasp::bench {
namespace {

/// The command of a served tick came late, or not at all.
bool late(const Tick& t, const FlightTimes& times) {
  return t.value.sent != 0 &&
         (t.value.written_at_ns == 0 || t.value.written_at_ns - t.value.due_at_ns > times.deadline_ns);
}

/// Releases between two served ticks that the work of the first one swallowed.
void add_skipped(const Tick& tick, const Tick& next, const FlightTimes& times,
                 const std::vector<const std::vector<tools::Wakeup>*>& trusted, std::vector<Miss>& misses) {
  const TimeNs back_at = std::max(tick.at_ns, tick.value.released_at_ns);
  const TimeNs first = tick.value.due_at_ns;
  for (TimeNs due = first + times.period_ns; due < next.value.due_at_ns - times.period_ns / 2; due += times.period_ns) {
    if (back_at <= due) continue;
    Miss m{due, back_at - due, true, stalled_ns(trusted, first, back_at)};
    m.woken_late = tick.value.released_at_ns > due;
    m.host_noise = back_at - m.host_ns <= due;  // without the stalls it would have been back in time
    misses.push_back(m);
  }
}

}  // namespace

const char* Miss::cause() const {
  if (host_noise) return "host noise";
  return woken_late ? "woken late, though the host ran: another real-time thread, or the kernel, held the core"
                    : "control's own work";
}

DurationNs stalled_ns(const std::vector<const std::vector<tools::Wakeup>*>& references, TimeNs from_ns, TimeNs to_ns) {
  std::vector<std::pair<TimeNs, TimeNs>> spans;
  for (const auto* reference : references)
    for (const auto& w : *reference) {
      const TimeNs from = std::max(w.due_at_ns, from_ns), to = std::min(w.due_at_ns + w.late_ns, to_ns);
      if (from < to) spans.emplace_back(from, to);
    }
  std::sort(spans.begin(), spans.end());
  DurationNs sum = 0;
  TimeNs covered = from_ns;
  for (const auto& [from, to] : spans) {
    sum += std::max<DurationNs>(0, to - std::max(from, covered));
    covered = std::max(covered, to);
  }
  return sum;
}

std::vector<Miss> find_misses(const std::vector<Tick>& ticks, const FlightTimes& times,
                              const std::vector<const std::vector<tools::Wakeup>*>& trusted) {
  std::vector<Miss> misses;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const Tick& t = ticks[i];
    if (late(t, times)) {
      const TimeNs end = t.value.written_at_ns != 0 ? t.value.written_at_ns : std::max(t.at_ns, t.value.released_at_ns);
      Miss m{t.value.due_at_ns, end - t.value.due_at_ns, false, stalled_ns(trusted, t.value.due_at_ns, end)};
      m.woken_late = t.value.released_at_ns - t.value.due_at_ns > times.deadline_ns;
      m.host_noise = t.value.written_at_ns != 0 && m.late_ns - m.host_ns <= times.deadline_ns;
      misses.push_back(m);
    }
    if (i + 1 < ticks.size()) add_skipped(t, ticks[i + 1], times, trusted, misses);
  }
  return misses;
}

std::vector<const std::vector<tools::Wakeup>*> trusted_references(const PairData& pair) {
  std::vector<const std::vector<tools::Wakeup>*> trusted;
  if (pair.setup.witness_priority > pair.setup.control_priority) trusted.push_back(&pair.witness);
  if (pair.setup.reference_priority > pair.setup.control_priority)
    for (const auto& half : pair.reference) trusted.push_back(&half);
  return trusted;
}

}  // namespace wasp::bench
