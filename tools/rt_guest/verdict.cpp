#include "tools/rt_guest/verdict.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/latency_summary.h"

namespace wasp::tools::rt_guest {
namespace {

const StageSummary* find(const std::vector<StageSummary>& stages, std::string_view stage) {
  const auto it = std::find_if(stages.begin(), stages.end(),
                               [&](const auto& s) { return s.owner == "control" && s.stage == stage && s.count > 0; });
  return it == stages.end() ? nullptr : &*it;
}

double microseconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-3; }

Row read_row(const Job& job, const JobOutcome& outcome) {
  Row row{.job = job};
  if (!outcome.figures.is_object()) return row;
  const auto stages = stages_from_json(outcome.figures);
  const RunSummary run = run_from_json(outcome.figures);
  const StageSummary* release = find(stages, "wake-up");
  const StageSummary* last_byte = find(stages, "tick to byte");
  if (!run.present || release == nullptr || last_byte == nullptr) return row;
  row.present = true;
  row.cycles = static_cast<std::int64_t>(run.ticks);
  row.missed_releases = static_cast<std::int64_t>(run.skipped);
  row.missed_deadlines = static_cast<std::int64_t>(run.deadline_misses);
  row.page_faults = static_cast<std::int64_t>(run.minor_faults + run.major_faults);
  row.release_p999_us = microseconds(release->p999_ns);
  row.release_max_us = microseconds(release->max_ns);
  row.last_byte_max_us = microseconds(last_byte->max_ns);
  return row;
}

Result yes(std::string name, bool ok) { return {std::move(name), ok ? 1.0 : 0.0, "", "== 1", ok}; }

Result exactly(std::string name, std::int64_t value, std::int64_t bar) {
  return {std::move(name), static_cast<double>(value), "", fmt::format("== {}", bar), value == bar};
}

Result at_least(std::string name, std::int64_t value, std::int64_t bar) {
  return {std::move(name), static_cast<double>(value), "", fmt::format(">= {}", bar), value >= bar};
}

void judge_function(const Row& row, const JobOutcome& outcome, std::vector<Result>& out) {
  const std::string& name = row.job.name;
  const RunSummary run = run_from_json(outcome.figures);
  out.push_back(yes(name + ": flight says real time on PREEMPT_RT", run.real_time && run.preempt_rt));
  // Not the mission's result: frames do not follow the vehicle, so it may be far from the ground when they end.
  out.push_back(yes(name + ": ended in order", run.finished && (outcome.exit_code == 0 || outcome.exit_code == 1)));
  out.push_back(at_least(name + ": control cycles", row.cycles, row.job.cycles));
  out.push_back(exactly(name + ": page faults in real-time threads", row.page_faults, 0));
}

void judge_timing(const Row& row, const Bars& bars, std::vector<Result>& out) {
  const std::string& name = row.job.name;
  out.push_back(exactly(name + ": missed releases", row.missed_releases, 0));
  out.push_back(exactly(name + ": missed deadlines", row.missed_deadlines, 0));
  out.push_back(at_most(name + ": control release, max", row.release_max_us, "us", bars.release_us));
  out.push_back(at_most(name + ": tick to last byte, max", row.last_byte_max_us * 1e-3, "ms", bars.last_byte_ms));
}

void judge_negative(const Row& row, const Bars& bars, std::vector<Result>& out) {
  const std::string& name = row.job.name;
  out.push_back(at_least(name + ": control cycles", row.cycles, row.job.cycles));
  out.push_back({name + ": control release, max", row.release_max_us * 1e-3, "ms",
                 fmt::format("> {}", bars.not_real_time_ms), row.release_max_us * 1e-3 > bars.not_real_time_ms});
}

void judge_flight(const Bars& bars, const Row& row, const JobOutcome& outcome, std::vector<Result>& out) {
  if (!row.job.real_time) return judge_negative(row, bars, out);
  judge_function(row, outcome, out);
  judge_timing(row, bars, out);
}

/// `wasp flight --check-rights` ends with 0 for root and 3 for a user, whose flight is refused by name.
void judge_rights(const std::string& name, const nlohmann::json& f, std::vector<Result>& out) {
  const auto number = [&](const char* key) {
    return f.is_object() && f.contains(key) && f[key].is_number_integer() ? f[key].get<std::int64_t>() : -1;
  };
  out.push_back(exactly(name + ": root lacks none", number("root"), 0));
  out.push_back(exactly(name + ": a user's exit code", number("user"), 3));
  out.push_back(at_least(name + ": rights named to a user", number("user_rights_missing"), 1));
  out.push_back(exactly(name + ": exit code of a user's flight", number("user_flight"), 1));
  out.push_back(at_least(name + ": refusals to arm", number("user_flight_refusals"), 1));
}

/// Every cell of the campaign that was not skipped kept its promise, and there were as many as were asked for.
void judge_faults(const Job& job, const nlohmann::json& f, std::vector<Result>& out) {
  std::int64_t tried = 0;
  if (f.is_object() && f.contains("cells"))
    for (const auto& cell : f["cells"]) {
      const std::string verdict = cell.value("verdict", "");
      if (verdict == "skipped") continue;
      ++tried;
      std::string name = job.name + ": " + cell.value("fault", "") + ", answered [ms]";
      const auto ms = [&](const char* key) {
        return cell.contains(key) && cell[key].is_number() ? cell[key].get<double>() : 0;
      };
      std::string bar = "promise kept";
      if (ms("recovered_ms") > 0) bar += fmt::format("; back after {:.0f} ms", ms("recovered_ms"));
      out.push_back({std::move(name), ms("response_ms"), "ms", std::move(bar), verdict == "ok"});
    }
  out.push_back(at_least(job.name + ": faults done", tried, job.fault_count));
}

/// Fed through a flight that outlasts its limit, quiet after an orderly end, and biting once nobody feeds it.
void judge_watchdog(const Job& job, const Bars& bars, const nlohmann::json& f, std::vector<Result>& out) {
  const auto number = [&](const char* key) {
    return f.is_object() && f.contains(key) && f[key].is_number_integer() ? f[key].get<std::int64_t>() : -1;
  };
  const bool there = f.is_object();
  out.push_back(exactly(job.name + ": its limit [s]", number("limit_s"), 2));
  out.push_back(at_least(job.name + ": seconds fed in flight", number("active_s"), 4));
  out.push_back(yes(job.name + ": the flight ended in order", number("flight") == 0 || number("flight") == 1));
  out.push_back(yes(job.name + ": disarmed by an orderly end", there && f.value("after", "") == "inactive"));
  out.push_back(at_least(job.name + ": outlived that end [s]", number("outlived_s"), 5));
  out.push_back(
      yes(job.name + ": restarts the board once its guardian is killed", there && f.value("restarted", false)));
  Result within = at_most(job.name + ": within", static_cast<double>(number("alive_ms")), "ms", bars.restart_ms);
  within.ok = within.ok && number("alive_ms") > 0;
  out.push_back(std::move(within));
}

}  // namespace

std::vector<Row> read_rows(const Plan& plan, const std::map<std::string, JobOutcome>& outcomes) {
  std::vector<Row> rows;
  for (const Job& job : plan.jobs) {
    if (job.kind != JobKind::kFlight) continue;
    const auto it = outcomes.find(job.name);
    rows.push_back(it == outcomes.end() ? Row{.job = job} : read_row(job, it->second));
  }
  return rows;
}

std::vector<Result> judge(const Plan& plan, const std::map<std::string, JobOutcome>& outcomes) {
  std::vector<Result> results;
  for (const Job& job : plan.jobs) {
    if (job.kind != JobKind::kRights) continue;
    const auto it = outcomes.find(job.name);
    judge_rights(job.name, it == outcomes.end() ? nlohmann::json() : it->second.figures, results);
  }
  for (const Job& job : plan.jobs) {
    const auto figures = outcomes.contains(job.name) ? outcomes.at(job.name).figures : nlohmann::json();
    if (job.kind == JobKind::kFaults) judge_faults(job, figures, results);
    if (job.kind == JobKind::kWatchdog) judge_watchdog(job, plan.bars, figures, results);
  }
  for (const Row& row : read_rows(plan, outcomes)) {
    results.push_back(yes(row.job.name + ": figures handed back", row.present));
    if (row.present) judge_flight(plan.bars, row, outcomes.at(row.job.name), results);
  }
  return results;
}

std::string table(const std::vector<Row>& rows) {
  std::string text =
      fmt::format("{:<14} {:<11} {:<9} {:>7} {:>9} {:>10} {:>7} {:>13} {:>13} {:>14}\n", "FLIGHT", "SCHEDULER", "LOAD",
                  "CYCLES", "RELEASES", "DEADLINES", "FAULTS", "RELEASE p99.9", "RELEASE max", "LAST BYTE max");
  text += fmt::format("{:<14} {:<11} {:<9} {:>7} {:>9} {:>10}\n", "", "", "", "", "missed", "missed");
  for (const Row& r : rows) {
    text += fmt::format("{:<14} {:<11} {:<9} ", r.job.name, r.job.real_time ? "SCHED_FIFO" : "SCHED_OTHER",
                        r.job.stressed ? "stress-ng" : "idle");
    text += r.present ? fmt::format("{:>7} {:>9} {:>10} {:>7} {:>10.1f} us {:>10.1f} us {:>11.1f} us\n", r.cycles,
                                    r.missed_releases, r.missed_deadlines, r.page_faults, r.release_p999_us,
                                    r.release_max_us, r.last_byte_max_us)
                      : "no figures\n";
  }
  return text;
}

}  // namespace wasp::tools::rt_guest
