#include "tools/top_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/csv_rows.h"

namespace wasp::tools {
namespace {

using Lines = std::vector<std::string>;

std::string age_text(const std::optional<double>& age_ms) {
  return age_ms ? duration_text(static_cast<std::int64_t>(*age_ms * 1e6)) : "-";
}

std::string_view mission_text(std::uint32_t result) {
  return result == 1 ? "flown to its end" : result == 2 ? "broken off" : result == 3 ? "stopped early" : "under way";
}

/// Behaviours that are not punctual, by name; empty when all are.
std::string late_behaviours(const RunSummary& r) {
  std::string text;
  for (std::size_t i = 0; i < std::min(r.behaviours.size(), r.behaviour_states.size()); ++i)
    if (r.behaviour_states[i] == 1 || r.behaviour_states[i] == 2)  // 3: not enabled
      text += fmt::format("   {} {}", r.behaviours[i], r.behaviour_states[i] == 1 ? "OVER BUDGET" : "DEMOTED");
  return text;
}

void add_regions(const TopSnapshot& s, Lines& lines) {
  for (const auto& r : s.regions) {
    if (!r.attached) {
      lines.push_back(fmt::format("{:<34} absent", r.name));
      continue;
    }
    lines.push_back(fmt::format("{:<34} writer {} {}{}{}", r.name, r.writer_pid, r.writer_alive ? "alive" : "HAS ENDED",
                                r.writer_restarts > 0 ? fmt::format(", restarted {} times", r.writer_restarts) : "",
                                r.note.empty() ? "" : ", note: " + r.note));
  }
}

void add_flight(const TopSnapshot& s, Lines& lines) {
  if (s.command) {
    const Command& c = *s.command;
    lines.push_back(fmt::format(
        "mode {} ({})   phase {}   tick {}   height {:.2f} m of {:.2f} m   climb {:+.2f} m/s   thrust {:.2f}",
        mode_name(c.mode), reason_name(c.reason), c.mission_phase, c.tick, c.height_m, c.height_setpoint_m,
        c.climb_rate_mps, c.thrust));
  } else {
    lines.emplace_back("no command yet");
  }
  if (!s.run.present) return;
  const RunSummary& r = s.run;
  lines.push_back(fmt::format(
      "{}{}, mission {}   ticks {}   skipped {}   deadline misses {}   page faults {} minor {} major",
      r.faults_armed ? "FAULTS ARMED, " : "",
      r.finished ? "finished"
      : r.armed  ? "armed"
                 : "disarmed",
      mission_text(r.mission_result), r.ticks, r.skipped, r.deadline_misses, r.minor_faults, r.major_faults));
  lines.push_back(fmt::format("frames lost {}   bad link frames {}   link reconnects {}", r.frames_lost, r.bad_frames,
                              r.link_reconnects));
  lines.push_back(fmt::format("incidents {}   refused as too old {}   old setpoints flushed {}{}", r.incidents,
                              r.commands_refused, r.setpoints_flushed, late_behaviours(r)));
}

void add_topics(const TopSnapshot& s, Lines& lines) {
  lines.push_back(fmt::format("{:<26} {:<10} {:>6} {:>10} {:>10} {:>12}", "TOPIC", "TYPE", "SLOTS", "RATE [Hz]", "AGE",
                              "PUBLISHED"));
  for (const auto& t : s.topics)
    lines.push_back(fmt::format("{:<26} {:<10} {:>6} {:>10.2f} {:>10} {:>12}", t.name, t.type, t.slots, t.rate_hz,
                                age_text(t.age_ms), t.published));
}

void add_stages(const TopSnapshot& s, Lines& lines) {
  lines.push_back(fmt::format("{:<20} {:<14} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7}", "OWNER", "STAGE", "COUNT",
                              "p50", "p99", "p99.9", "max", "budget", "misses"));
  for (const auto& st : s.stages)
    lines.push_back(fmt::format("{:<20} {:<14} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7}", st.owner, st.stage, st.count,
                                duration_text(st.p50_ns), duration_text(st.p99_ns), duration_text(st.p999_ns),
                                duration_text(st.max_ns), st.budget_ns > 0 ? duration_text(st.budget_ns) : "-",
                                st.budget_ns > 0 ? std::to_string(st.misses) : "-"));
}

/// Whatever another process wrote must not steer the terminal.
void make_printable(std::string& line) {
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
}

}  // namespace

std::string real_time_line(const TopSnapshot& s) {
  if (!s.run.present) return "no flight process";
  if (!s.run.real_time) return "NOT REAL TIME";
  return s.run.preempt_rt ? "REAL TIME (PREEMPT_RT kernel)" : "REAL TIME policies on a kernel without PREEMPT_RT";
}

std::vector<std::string> top_lines(const TopSnapshot& s) {
  Lines lines;
  lines.push_back(fmt::format("wasp-top  instance {}   *** {} ***", s.instance, real_time_line(s)));
  add_regions(s, lines);
  lines.emplace_back();
  add_flight(s, lines);
  lines.emplace_back();
  for (const auto& camera : s.cameras) {
    lines.push_back(counts_text(camera));
    lines.push_back("  " + times_text(camera));
  }
  add_topics(s, lines);
  lines.emplace_back();
  add_stages(s, lines);
  for (const auto& event : s.events) lines.push_back("event: " + event);
  for (auto& line : lines) make_printable(line);
  return lines;
}

}  // namespace wasp::tools
