// What one pair of `wasp bench latency` brings home: every control tick and every cue of the flight, every wake-up of
// the references that ran beside it, all with their instants on CLOCK_MONOTONIC.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "tools/latency_summary.h"
#include "tools/wakeups.h"
#include "types/messages.h"

namespace wasp::bench {

template <class T>
struct Published {
  T value{};
  TimeNs at_ns = 0;  ///< when it was published: for a command, the end of the control tick's work
};
using Tick = Published<Command>;
using SeenCue = Published<Cue>;

/// What the figures are judged against, from the configuration.
struct FlightTimes {
  DurationNs period_ns = 50 * kMillisecond;
  DurationNs deadline_ns = 10 * kMillisecond;
  DurationNs budget_ns = 2 * kMillisecond;  ///< of the control step
  [[nodiscard]] DurationNs slack_ns() const { return deadline_ns - budget_ns; }
};

/// Who ran beside control, and how.
struct PairSetup {
  std::string load;
  int index = 0;  ///< within its load
  int core = 1;
  int control_priority = 80, reference_priority = 81, witness_priority = 90;
  DurationNs reference_lead_ns =
      0;                   ///< the reference's grid behind control's in one half of the pair, before it in the other
  bool cyclictest = true;  ///< false: a loop of our own stands in for it
  bool real_time = true;
};

struct PairData {
  PairSetup setup;
  FlightTimes times;
  std::vector<Tick> ticks;
  std::vector<std::string> behaviours;
  std::vector<std::vector<SeenCue>> cues;             ///< by behaviour
  std::vector<std::vector<tools::Wakeup>> reference;  ///< cyclictest, by half of the pair
  std::vector<tools::Wakeup> witness;                 ///< our own loop, above everybody, in the middle of the deadline
  std::size_t lost = 0;                               ///< ticks and cues the observer was too late for
  std::set<std::string> foreign;  ///< real-time threads of others seen on the core, at control's priority or above
  tools::RunSummary run;
};

/// Ticks due in [from, to].
std::vector<Tick> ticks_between(const std::vector<Tick>& ticks, TimeNs from_ns, TimeNs to_ns);
/// Control's wake-ups: due, late, busy until its work was done.
std::vector<tools::Wakeup> control_wakeups(const std::vector<Tick>& ticks);

}  // namespace wasp::bench
