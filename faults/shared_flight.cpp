#include "faults/shared_flight.h"

#include <fmt/format.h>

#include <algorithm>

#include "faults/blame.h"
#include "faults/injector.h"
#include "rt/clock.h"
#include "sim/random.h"

namespace wasp::faults {
namespace {

constexpr double kReach_s = 60, kReachGenerous_s = 600;              // to the phase, with times judged and without
constexpr double kSettle_s = 20;                                     // back to it
constexpr double kRecover_s = 4, kGenerous_s = 40, kLanding_s = 15;  // after a fault, with times judged and without
constexpr double kAfterwards_s = 0.6;                                // watched after the recovery
constexpr DurationNs kOverrun = kMillisecond;                        // of the reference loop: one of its periods
constexpr float kCorridorEnd_m = 22.f;                               // of 30

/// Promises after which the flight does not command any more.
bool final(const Fault& fault) {
  return fault.isolated || fault.promise == Promise::kGuardian || fault.promise == Promise::kEnds;
}

/// Its recorder must lose records, and count them.
bool tries_the_disk(const Fault& fault) { return fault.injector == Injector::kDisk && fault.what != "full"; }

/// Phases that pass by themselves while faults are done: a flight in them may end.
bool passes(Phase phase) { return phase == Phase::kTakeOff || phase == Phase::kLanding; }

/// How long the reference loop stood still. Of one standstill every wake-up that fell into it is late: it counts once.
DurationNs reference_late_ns(const std::vector<tools::Wakeup>& reference, const Stretch& within) {
  DurationNs sum = 0;
  TimeNs counted_until_ns = kNever;
  for (const tools::Wakeup& w : reference) {
    const TimeNs ran_ns = w.due_at_ns + w.late_ns;
    if (ran_ns < within.from_ns || w.due_at_ns > within.until_ns || w.late_ns < kOverrun) continue;
    sum += std::max<DurationNs>(0, ran_ns - std::max(w.due_at_ns, counted_until_ns));
    counted_until_ns = std::max(counted_until_ns, ran_ns);
  }
  return sum;
}

DurationNs overlap_ns(const std::vector<Stretch>& stretches, const Stretch& with) {
  DurationNs sum = 0;
  for (const Stretch& s : stretches)
    sum += std::max<DurationNs>(0, std::min(s.until_ns, with.until_ns) - std::max(s.from_ns, with.from_ns));
  return sum;
}

/// By how much a violation is beyond its bar; infinite where no delay of the host explains it.
double excess_ms(const Violation& v, const WireLimits& limits) {
  if (v.offence == Offence::kGap) return v.value - to_seconds(limits.longest_gap_ns) * 1e3;
  if (v.offence == Offence::kOldEvidence) return v.value - to_seconds(limits.cue_age_ns) * 1e3;
  return Blame::kNotExplained;
}

/// The first line with `text` from then on, nullptr: there is none.
const LogLine* said_since(const std::vector<LogLine>& log, std::string_view text, TimeNs since_ns) {
  const auto line = std::ranges::find_if(
      log, [&](const LogLine& l) { return l.at_ns >= since_ns && l.text.find(text) != std::string::npos; });
  return line == log.end() ? nullptr : &*line;
}

}  // namespace

SharedFlight::SharedFlight(const CampaignOptions& options, const FlightPlan& plan, const CampaignHooks& hooks)
    : options_(options), plan_(plan), hooks_(hooks), flight_(plan_) {}

/// False when the flight ended, or we were interrupted, before.
bool SharedFlight::sleep_until(TimeNs until_ns) {
  while (rt::now() < until_ns && flight_.running() && !hooks_.interrupted())
    rt::sleep_until(std::min(until_ns, rt::now() + 10 * kMillisecond));
  return rt::now() >= until_ns;
}

std::vector<CellResult> SharedFlight::fly(std::deque<Cell>& queue, std::size_t before, std::size_t total) {
  const bool there = flight_.wait_for(plan_.phase, options_.times ? kReach_s : kReachGenerous_s);
  if (!there) {
    CellResult result{.cell = queue.front(), .verdict = Verdict::kMiss, .why = "the flight never came so far"};
    if (const auto log = flight_.log(); !log.empty()) result.why += ": " + log.back().text;
    result.folder = plan_.folder;
    if (hooks_.interrupted()) result.verdict = Verdict::kSkipped, result.why = "interrupted";
    queue.pop_front();
    return {result};
  }
  do {
    const Cell cell = queue.front();
    if (!done_.empty() && plan_.phase == Phase::kCruise && flight_.watch().truth().position_ned_m[0] > kCorridorEnd_m)
      break;  // the end of the corridor
    queue.pop_front();
    done_.push_back(try_cell(cell));
    hooks_.tried(before + done_.size(), total);
    if (final(*cell.fault) || options_.isolate) break;
    const TimeNs patience_ns = rt::now() + from_seconds(kSettle_s);
    while (!flight_.settled(plan_.phase) && !flight_.past(plan_.phase) && flight_.running() &&
           rt::now() < patience_ns && !hooks_.interrupted())
      rt::sleep_until(rt::now() + 10 * kMillisecond);
  } while (!queue.empty() && flight_.settled(plan_.phase) && !hooks_.interrupted());
  flight_.end(plan_.phase == Phase::kLanding ? 25 : 3);  // a landing is watched to its end
  return judge();
}

SharedFlight::Done SharedFlight::try_cell(const Cell& cell) {
  sim::Random random(sim::mix(cell.seed, static_cast<std::uint32_t>(done_.size())));
  sleep_until(rt::now() + from_seconds(random.uniform(0.0, 0.1)));  // anywhere between two control ticks
  Done done{.cell = cell};
  const Injected injected = inject(*cell.fault, flight_, random.bits());
  done.trial.began_ns = injected.at_ns;
  done.error = injected.error;
  sleep_until(injected.at_ns + from_seconds(cell.fault->for_s));
  done.trial.ended_ns = rt::now();
  if (injected.undo) injected.undo();
  if (done.error.empty()) wait_for_answer(cell);
  done.trial.watched_until_ns = rt::now();
  if (!final(*cell.fault)) {  // a busy host may take a while
    const TimeNs until_ns = rt::now() + from_seconds(kSettle_s);
    while (!flight_.commanded(plan_.phase) && !flight_.past(plan_.phase) && flight_.running() && rt::now() < until_ns &&
           !hooks_.interrupted())
      rt::sleep_until(rt::now() + 10 * kMillisecond);
  }
  done.outcome = outcome();
  done.interrupted = hooks_.interrupted();
  done.crashed = flight_.exit_code().value_or(0) >= 126;
  done.counts = flight_.watch().counts();
  return done;
}

/// Until the fault is recovered from and a little longer, or patience is over.
void SharedFlight::wait_for_answer(const Cell& cell) {
  const Fault& fault = *cell.fault;
  const double landing_s = final(fault) ? kLanding_s : 0;
  const double patience_s = options_.times ? fault.recovered_ms * 1e-3 + kRecover_s + landing_s : kGenerous_s;
  const TimeNs until_ns = rt::now() + from_seconds(patience_s);
  const auto answered = [&] {
    if (fault.promise == Promise::kEnds) return !flight_.running();
    if (fault.promise != Promise::kGuardian)
      return flight_.commanded(plan_.phase) || (plan_.phase == Phase::kLanding && flight_.past(plan_.phase));
    return cell.phase == Phase::kIdle ? flight_.watch().counts().incarnation > 0 : !flight_.running();
  };
  while (rt::now() < until_ns && flight_.running() && !hooks_.interrupted() && !answered())
    rt::sleep_until(rt::now() + 10 * kMillisecond);
  sleep_until(rt::now() + from_seconds(kAfterwards_s));
}

std::string SharedFlight::outcome() {
  const auto code = flight_.exit_code();
  const auto& texts = flight_.wire().texts;
  if (code && *code < 128 && !texts.empty() && texts.back().text.find("landed") != std::string::npos)
    return "landed by autopilot";
  if (code) return *code == 0 ? "flown to its end" : fmt::format("ended, code {}", *code);
  const FlightCounts counts = flight_.watch().counts();
  if (counts.incarnation > 0) return "started again";
  return flight_.commanded(plan_.phase) ? "goes on" : "flies on otherwise";
}

WireEvidence SharedFlight::evidence() const {
  auto& flight = const_cast<FlightUnderTest&>(flight_);
  WireEvidence e;
  e.commands = flight.watch().commands();
  e.exposures = flight.watch().exposures();
  e.not_joined = flight.watch().commands_unseen();
  e.unseen = flight.watch().exposures_unseen();
  TimeNs guardian_since_ns = kNever;
  for (const CompanionBeat& beat : flight.wire().beats) {
    if (beat.state.guardian && guardian_since_ns == kNever) guardian_since_ns = beat.at_ns - 100 * kMillisecond;
    if (beat.state.guardian || guardian_since_ns == kNever) continue;
    e.not_joined.push_back({guardian_since_ns, beat.at_ns});
    guardian_since_ns = kNever;
  }
  if (guardian_since_ns != kNever) e.not_joined.push_back({guardian_since_ns, kForever});
  for (const Done& d : done_) {
    const Fault& f = *d.cell.fault;
    const bool silent =
        f.promise == Promise::kGuardian || f.promise == Promise::kLineBack || f.noisy || f.injector == Injector::kCore;
    if (silent) e.gaps_excused.push_back({d.trial.began_ns, d.trial.watched_until_ns});
    if (f.promise == Promise::kGuardian)
      e.not_joined.push_back({d.trial.began_ns - 100 * kMillisecond, d.trial.watched_until_ns});
    if (f.tainted_after_ms > 0)
      // an exposure is relayed up to 60 ms later: those at the end meet a fault that is over
      e.tainted.push_back(
          {d.trial.began_ns + from_seconds(f.tainted_after_ms * 1e-3), d.trial.ended_ns - 60 * kMillisecond});
  }
  return e;
}

std::vector<CellResult> SharedFlight::judge() {
  WireLimits limits = limits_of(plan_);
  if (!options_.times) limits.longest_gap_ns = limits.slack_ns = kSecond;
  const std::vector<Violation> violations = check_wire(flight_.wire(), limits, evidence());
  const std::vector<tools::Wakeup> reference = flight_.reference();
  account_ = flight_.recorder_account();
  std::vector<CellResult> results;
  for (const Done& d : done_) results.push_back(judge(d, limits, violations, reference));
  return results;
}

/// What came of the fault, from the wire and, where no wire tells, from the log and the ring.
Reaction SharedFlight::reaction_of(const Done& d, const std::vector<LogLine>& log) {
  Reaction reaction = react(flight_.wire(), d.trial);
  const Promise promise = d.cell.fault->promise;
  if (promise == Promise::kLineBack) {
    const LogLine* gone = said_since(log, "serial line gone", d.trial.began_ns);
    read_line(flight_.wire(), d.trial, gone == nullptr ? kForever : gone->at_ns, reaction);
  }
  if (promise == Promise::kGuardian) read_restart(flight_.watch().commands(), d.trial, reaction);
  return reaction;
}

/// Those between this fault and the next.
std::vector<Violation> SharedFlight::violations_of(const Done& d, const std::vector<Violation>& all) const {
  if (done_.size() == 1) return all;
  TimeNs next_ns = kForever;
  for (const Done& other : done_)
    if (other.trial.began_ns > d.trial.began_ns) next_ns = std::min(next_ns, other.trial.began_ns);
  std::vector<Violation> own;
  std::ranges::copy_if(all, std::back_inserter(own),
                       [&](const Violation& v) { return v.at_ns >= d.trial.began_ns && v.at_ns < next_ns; });
  return own;
}

void SharedFlight::judge_breach(const Done& d, const CellResult& r, Blame& blame) {
  const auto breach = breach_of(*d.cell.fault, d.trial, d.cell.phase, r.reaction, options_.times);
  if (!breach) return;
  const TimeNs alarm_ns = d.trial.began_ns + from_seconds(r.reaction.detected_ms.value_or(0) * 1e-3);
  const Stretch before{alarm_ns - 300 * kMillisecond, alarm_ns};
  const bool camera_late = d.cell.fault->promise == Promise::kUnaffected && r.reaction.detected_ms &&
                           overlap_ns(flight_.watch().camera_pauses(), before) > 0;
  if (camera_late)
    blame.noise("alarm: the camera's process was late");
  else
    blame.late(breach->why, breach->excess_ms, breach->waited);
}

void SharedFlight::judge_outcome(const Done& d, const CellResult& r, Blame& blame) {
  const Fault& fault = *d.cell.fault;
  const bool may_end = final(fault) || passes(plan_.phase);
  if (!may_end && d.outcome != "goes on") blame.broken("the flight did not go on: " + d.outcome);
  if (d.counts.incarnation > 0 && fault.promise != Promise::kGuardian)
    blame.broken("the flight process died and was started again");
  if (d.crashed) blame.broken("crashed: " + d.outcome);
  if (fault.promise == Promise::kEnds && d.outcome.starts_with("flies on")) blame.broken("it did not end");
  if (fault.promise == Promise::kEnds && flight_.wire().armed()) blame.broken("the vehicle was left armed");
  if (!tries_the_disk(fault)) return;
  if (!account_.wrong.empty()) blame.broken(account_.wrong);
  if (r.records_lost == 0) blame.broken("nothing was lost to the disk: it was none");
}

void SharedFlight::judge_words(const Done& d, const std::vector<LogLine>& log, CellResult& r, Blame& blame) {
  const Fault& fault = *d.cell.fault;
  if (fault.says.empty() || !answers_in(fault, d.cell.phase)) return;
  const LogLine* said = said_since(log, fault.says, d.trial.began_ns - 5 * kMillisecond);
  if (said == nullptr) return blame.broken(fmt::format("nobody says '{}'", fault.says));
  const double after_ms = to_seconds(said->at_ns - d.trial.began_ns) * 1e3;
  if (!r.reaction.detected_ms) r.reaction.detected_ms = std::max(0.0, after_ms);
  const bool timed = fault.promise == Promise::kBounded || fault.promise == Promise::kEnds;
  if (options_.times && timed && fault.detected_ms > 0 && after_ms > fault.detected_ms)
    blame.late(fmt::format("said after {:.0f} ms, promised {:.0f}", after_ms, fault.detected_ms),
               after_ms - fault.detected_ms, {d.trial.began_ns, said->at_ns});
}

CellResult SharedFlight::judge(const Done& d, const WireLimits& limits, const std::vector<Violation>& violations,
                               const std::vector<tools::Wakeup>& reference) {
  CellResult r{.cell = d.cell, .verdict = Verdict::kOk, .why = {}, .outcome = d.outcome};
  r.folder = plan_.folder;
  if (d.interrupted) return r.verdict = Verdict::kSkipped, r.why = "interrupted", r;
  const std::vector<LogLine> log = flight_.log();
  r.records_lost = account_.lost + account_.refused;
  r.reaction = reaction_of(d, log);
  r.violations = violations_of(d, violations);
  const std::vector<Stretch> stalls = flight_.tap().stalls();
  Blame blame(r, [&](const Stretch& waited) {
    const DurationNs late_ns = d.cell.fault->noisy ? 0 : reference_late_ns(reference, waited);
    return to_seconds(late_ns + overlap_ns(stalls, waited)) * 1e3;
  });
  if (!d.error.empty()) blame.broken(d.error);
  judge_breach(d, r, blame);
  for (const Violation& v : r.violations) {
    const std::string why = fmt::format("{} on the wire ({:.3g})", name_of(v.offence), v.value);
    if (const double excess = excess_ms(v, limits); excess > v.held_ms)
      blame.late(why, excess, {v.at_ns - kSecond, v.at_ns});
    else
      blame.noise(why + fmt::format(", held by the line for {:.1f} ms", v.held_ms));
  }
  judge_outcome(d, r, blame);
  judge_words(d, log, r, blame);
  return r;
}

}  // namespace wasp::faults
