#include "scheduling/incident.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

namespace wasp::scheduling {
namespace {

constexpr std::size_t kShownEvents = 24;  // of each thread in the text; the JSON has them all
constexpr std::size_t kShownShares = 20;

double milliseconds(DurationNs ns) { return static_cast<double>(ns) / kMillisecond; }

const char* name_of_trace(rt::TraceKind kind) {
  constexpr std::array kNames = {"?", "release", "computed", "written", "frame", "cue", "wake", "done"};
  const auto i = static_cast<std::size_t>(kind);
  return i < kNames.size() ? kNames[i] : "?";
}

bool of_control(MissKind kind) { return kind != MissKind::kOverBudget; }

/// "+11.902 ms", from the intended release; "-" if it did not happen.
std::string since(const Miss& m, TimeNs at_ns) {
  return at_ns == 0 ? "-" : fmt::format("{:+.3f} ms", milliseconds(at_ns - m.due_at_ns));
}

std::string shares_text(const Incident& i) {
  if (!i.trace_why_not.empty()) return "no trace of the scheduler: " + i.trace_why_not + "\n";
  std::string text = fmt::format("core {} from {} to {} of the intended release, by the kernel's trace:\n", i.core,
                                 since(i.miss, i.shares_from_ns), since(i.miss, i.shares_to_ns));
  if (i.shares.empty()) text += "  nothing was traced in this time\n";
  for (std::size_t k = 0; k < std::min(kShownShares, i.shares.size()); ++k) {
    const CoreShare& s = i.shares[k];
    text += s.pid < 0 ? fmt::format("  {:<32} {:>6} times\n", s.name, s.interrupts)
                      : fmt::format("  {:<24} pid {:<8} {:<8} {:>10.3f} ms\n", s.name, s.pid,
                                    s.priority < 0     ? "deadline"
                                    : s.priority < 100 ? fmt::format("fifo {}", 99 - s.priority)
                                                       : "other",
                                    milliseconds(s.ran_ns));
  }
  return text;
}

std::string counts_text(const Incident& i) {
  std::string text = fmt::format("by the kernel's counts, over the last {:.0f} ms:\n", milliseconds(i.window_ns));
  for (const auto& t : i.threads)
    text += t.counts ? fmt::format(
                           "  {:<18} core {:>2}  prio {:>2}  tid {:<7} ran {:>9.3f} ms  ready and waiting "
                           "{:>9.3f} ms  {} slices{}\n",
                           t.name, t.core, t.priority, t.tid, milliseconds(t.counts->ran_ns),
                           milliseconds(t.counts->run_delay_ns), t.counts->slices, t.demoted ? "  DEMOTED" : "")
                     : fmt::format("  {:<18} no counts\n", t.name);
  if (i.core_counts) {
    text += fmt::format("  core {}:", i.core);
    for (std::size_t k = 0; k < CoreCounts::kNames.size(); ++k)
      text += fmt::format(" {} {:.0f} ms", CoreCounts::kNames[k],
                          milliseconds(static_cast<DurationNs>(i.core_counts->ticks[k]) * core_tick_ns()));
    text += "\n";
  }
  return text;
}

std::string events_text(const Incident& i) {
  std::string text = "last events of each thread, from the intended release:\n";
  for (const auto& t : i.threads) {
    const std::size_t first = t.events.size() > kShownEvents ? t.events.size() - kShownEvents : 0;
    for (std::size_t k = first; k < t.events.size(); ++k) {
      const auto& e = t.events[k];
      text += fmt::format("  {:>14}  {:<18} {:<9} #{:<8} {:>10.3f} ms\n", since(i.miss, e.at_ns), t.name,
                          name_of_trace(e.kind), e.number, milliseconds(e.value_ns));
    }
  }
  return text;
}

}  // namespace

const char* name_of(MissKind kind) noexcept {
  constexpr std::array kNames = {"releases skipped", "deadline missed", "setpoint not taken by the serial line",
                                 "over budget", "command refused as too old"};
  const auto i = static_cast<std::size_t>(kind);
  return i < kNames.size() ? kNames[i] : "unknown";
}

std::string incident_headline(const Incident& i) {
  const Miss& m = i.miss;
  return fmt::format("{}: {}, {} {}, {:.3f} ms {} (limit {:.3f} ms){}, {} involuntary switches", i.thread,
                     name_of(m.kind), of_control(m.kind) ? "tick" : "frame", m.number, milliseconds(m.late_ns),
                     of_control(m.kind) ? "after its intended release" : "in its step", milliseconds(m.limit_ns),
                     m.skipped > 0 ? fmt::format(", {} skipped", m.skipped) : "", m.usage.involuntary_switches);
}

std::string incident_text(const Incident& i) {
  const Miss& m = i.miss;
  std::string text = fmt::format("wasp incident {} of at most {}, instance {}, {}\n{}\n\n", i.number, i.limit,
                                 i.instance, i.wall_time, incident_headline(i));
  text += fmt::format("thread      {}, core {}, {}\n", i.thread, i.core,
                      i.real_time ? fmt::format("SCHED_FIFO {}", i.priority) : "SCHED_OTHER: NOT REAL TIME");
  text += fmt::format("{:<11} due at {:.6f} s; ran {}; computed {}; last byte {}\n",
                      of_control(m.kind) ? "release" : "frame", to_seconds(m.due_at_ns), since(m, m.released_at_ns),
                      since(m, m.computed_at_ns), since(m, m.written_at_ns));
  text +=
      fmt::format("since the {} before: {} involuntary and {} voluntary switches, {} minor and {} major page faults\n",
                  of_control(m.kind) ? "tick" : "frame", m.usage.involuntary_switches, m.usage.voluntary_switches,
                  m.usage.minor_faults, m.usage.major_faults);
  if (i.more > 0) text += fmt::format("{} more misses fell into the time in which this one was looked at\n", i.more);
  return text + "\nWhat ran instead\n" + shares_text(i) + counts_text(i) + "\n" + events_text(i);
}

std::string incident_json(const Incident& i) {
  const Miss& m = i.miss;
  nlohmann::json doc{{"incident", i.number},
                     {"instance", i.instance},
                     {"wall_time", i.wall_time},
                     {"thread", i.thread},
                     {"core", i.core},
                     {"priority", i.priority},
                     {"real_time", i.real_time},
                     {"kind", name_of(m.kind)},
                     {of_control(m.kind) ? "tick" : "frame", m.number},
                     {"late_ns", m.late_ns},
                     {"limit_ns", m.limit_ns},
                     {"skipped", m.skipped},
                     {"due_at_ns", m.due_at_ns},
                     {"released_at_ns", m.released_at_ns},
                     {"computed_at_ns", m.computed_at_ns},
                     {"written_at_ns", m.written_at_ns},
                     {"involuntary_switches", m.usage.involuntary_switches},
                     {"voluntary_switches", m.usage.voluntary_switches},
                     {"minor_faults", m.usage.minor_faults},
                     {"major_faults", m.usage.major_faults},
                     {"more_misses", i.more},
                     {"window_ns", i.window_ns},
                     {"trace", i.trace_why_not.empty() ? "sched_switch" : "none: " + i.trace_why_not}};
  for (const auto& s : i.shares)
    doc["ran_instead"].push_back({{"name", s.name},
                                  {"pid", s.pid},
                                  {"priority", s.priority},
                                  {"ran_ns", s.ran_ns},
                                  {"interrupts", s.interrupts}});
  if (i.core_counts)
    for (std::size_t k = 0; k < CoreCounts::kNames.size(); ++k)
      doc["core_ticks"][CoreCounts::kNames[k]] = i.core_counts->ticks[k];
  for (const auto& t : i.threads) {
    nlohmann::json thread{
        {"name", t.name}, {"core", t.core}, {"priority", t.priority}, {"tid", t.tid}, {"demoted", t.demoted}};
    if (t.counts) {
      thread["ran_ns"] = t.counts->ran_ns;
      thread["run_delay_ns"] = t.counts->run_delay_ns;
      thread["slices"] = t.counts->slices;
    }
    for (const auto& e : t.events) thread["events"].push_back({e.at_ns, name_of_trace(e.kind), e.number, e.value_ns});
    doc["threads"].push_back(thread);
  }
  return doc.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace wasp::scheduling
