#include "faults/reaction.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace wasp::faults {
namespace {

double ms_between(TimeNs from_ns, TimeNs until_ns) { return to_seconds(until_ns - from_ns) * 1e3; }

bool tells(const CompanionBeat& beat, const std::optional<drivers::CompanionState>& before) {
  if (beat.alarmed() || beat.state.guardian) return true;
  if (!before) return false;
  if (beat.state.incarnation != before->incarnation) return true;
  return beat.state.mode != before->mode && beat.state.mode != FlightMode::kBehaviour;
}

void read_beats(const WireReader& wire, const Trial& trial, Reaction& r) {
  std::optional<drivers::CompanionState> before;
  for (const CompanionBeat& beat : wire.beats) {
    if (beat.at_ns > trial.watched_until_ns) break;
    if (beat.at_ns < trial.began_ns) {
      before = beat.state;
      continue;
    }
    r.alarmed = r.alarmed || beat.alarmed();
    r.guardian = r.guardian || beat.state.guardian;
    r.incarnation = beat.state.incarnation;
    if (!r.detected_ms && tells(beat, before)) {
      r.detected_ms = ms_between(trial.began_ns, beat.at_ns);
      r.reason = beat.state.reason, r.mode = beat.state.mode;
    }
    const bool commands = !beat.alarmed() && beat.state.mode == FlightMode::kBehaviour && beat.at_ns > trial.ended_ns;
    if (!r.recovered_ms && r.detected_ms && commands) r.recovered_ms = ms_between(trial.ended_ns, beat.at_ns);
  }
}

/// Neutral from when on: nothing else came until it was recovered from.
void read_setpoints(const WireReader& wire, const Trial& trial, Reaction& r) {
  TimeNs until_ns = trial.watched_until_ns;
  if (r.recovered_ms) until_ns = std::min(until_ns, trial.ended_ns + from_seconds(*r.recovered_ms * 1e-3));
  const Setpoint* last_steering = nullptr;
  const Setpoint* first_after = nullptr;
  TimeNs last_ns = trial.began_ns;
  for (const Setpoint& s : wire.setpoints) {
    if (s.at_ns < trial.began_ns) continue;
    if (s.at_ns >= until_ns) break;
    last_ns = s.at_ns;
    if (!s.neutral())
      last_steering = &s, first_after = nullptr;
    else if (first_after == nullptr)
      first_after = &s;
  }
  constexpr DurationNs kSilence = 500 * kMillisecond;  // the autopilot's own failsafe acts by then
  r.stream_ended = until_ns - last_ns > kSilence;
  if (first_after != nullptr)
    r.response_ms = ms_between(trial.began_ns, first_after->at_ns);
  else if (r.stream_ended)
    r.response_ms = last_steering == nullptr ? 0 : ms_between(trial.began_ns, last_steering->at_ns);
}

struct Bar {
  const char* name;
  double limit_ms;
  const std::optional<double>& measured_ms;
  TimeNs since_ns;
};

constexpr double kNotExplained = std::numeric_limits<double>::infinity();

/// What is late or missing of what the promise asks for.
std::optional<Breach> late(const Fault& fault, const Trial& trial, const Reaction& r, bool times) {
  const bool restart = fault.promise == Promise::kGuardian;
  for (const Bar& bar :
       {Bar{"detected", fault.detected_ms, r.detected_ms, trial.began_ns},
        Bar{"response", fault.response_ms, r.response_ms, trial.began_ns},
        Bar{"recovered", fault.recovered_ms, r.recovered_ms, restart ? trial.began_ns : trial.ended_ns}}) {
    if (bar.limit_ms <= 0) continue;
    if (!bar.measured_ms) return Breach{fmt::format("not {}", bar.name), kNotExplained};
    if (times && *bar.measured_ms > bar.limit_ms + 1e-3)
      return Breach{fmt::format("{} after {:.1f} ms, promised {:.0f}", bar.name, *bar.measured_ms, bar.limit_ms),
                    *bar.measured_ms - bar.limit_ms,
                    {bar.since_ns, bar.since_ns + from_seconds(*bar.measured_ms * 1e-3)}};
  }
  return std::nullopt;
}

}  // namespace

Reaction react(const WireReader& wire, const Trial& trial) {
  Reaction r;
  read_beats(wire, trial, r);
  read_setpoints(wire, trial, r);
  return r;
}

void read_line(const WireReader& wire, const Trial& trial, TimeNs gone_logged_ns, Reaction& r) {
  if (gone_logged_ns >= trial.began_ns && gone_logged_ns <= trial.watched_until_ns)
    r.detected_ms = ms_between(trial.began_ns, gone_logged_ns);
  const auto back = std::ranges::upper_bound(wire.setpoints, trial.ended_ns, {}, &Setpoint::at_ns);
  r.recovered_ms.reset();
  if (back != wire.setpoints.end()) r.recovered_ms = ms_between(trial.ended_ns, back->at_ns);
}

void read_restart(const std::vector<Command>& commands, const Trial& trial, Reaction& r) {
  r.recovered_ms.reset();
  for (std::size_t i = 1; i < commands.size() && !r.recovered_ms; ++i)
    if (commands[i].released_at_ns > trial.began_ns && commands[i].tick < commands[i - 1].tick)
      r.recovered_ms = ms_between(trial.began_ns, commands[i].released_at_ns);
}

bool answers_in(const Fault& fault, Phase phase) {
  return phase != Phase::kIdle || fault.promise == Promise::kGuardian || fault.promise == Promise::kLineBack;
}

std::optional<Breach> breach_of(const Fault& fault, const Trial& trial, Phase phase, const Reaction& r, bool times) {
  switch (fault.promise) {
    case Promise::kUnaffected:
      if (r.alarmed || r.guardian) return Breach{"alarm without cause", kNotExplained};
      return std::nullopt;
    case Promise::kGuardian:
      if (phase == Phase::kIdle)  // nothing to be said for: it commands nothing
        return r.recovered_ms ? std::nullopt : std::optional(Breach{"not started again", kNotExplained});
      if (!r.guardian) return Breach{"the guardian did not speak", kNotExplained};
      return late(fault, trial, r, times);
    case Promise::kNeutral:
      if (!answers_in(fault, phase)) return std::nullopt;
      if (!r.alarmed) return Breach{"no alarm", kNotExplained};
      return late(fault, trial, r, times);
    case Promise::kReported:
    case Promise::kLineBack:
      if (!answers_in(fault, phase)) return std::nullopt;
      return late(fault, trial, r, times);
    case Promise::kBounded:
    case Promise::kEnds:
    case Promise::kRestarts:
    case Promise::kRefused:
      break;
  }
  return std::nullopt;
}

}  // namespace wasp::faults
