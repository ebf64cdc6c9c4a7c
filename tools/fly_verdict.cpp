#include "tools/fly_verdict.h"

#include <fmt/format.h>

#include <ctime>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "rt/clock.h"
#include "rt/process.h"
#include "tools/child_process.h"
#include "tools/flight_results.h"
#include "tools/latency_table.h"
#include "tools/program_paths.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kEndedShort = 4;  // of wasp flight and wasp fly: in order, but short of its purpose

std::string scheduler_text(const Run& run) {
  return run.real_time ? "SCHED_FIFO, locked memory" : "SCHED_OTHER (not real time)";
}

/// Share of control ticks that may miss: none where kernel and rights promise real time, 5 % where one of them does not
/// (a simulation on a shared machine).
double allowed_share(const Run& run) { return run.real_time && rt::kernel_is_preempt_rt() ? 0.0 : 0.05; }

std::string camera_text(const Run& run) {
  if (!run.options.replay.empty()) return "recording " + run.options.replay;
  if (follows(run)) return "simulated Kinect, led by " + run.options.follow;
  return on_hardware(run) ? "real, " + run.camera_driver : "simulated Kinect";
}

nlohmann::json run_document(const Run& run, const std::vector<Phase>& phases, const std::vector<Result>& results,
                            const RunSummary& summary) {
  nlohmann::json doc{{"name", run.options.name},
                     {"mission", run.options.replay.empty() ? run.options.mission : "replay"},
                     {"seconds", run.flight_seconds},
                     {"kernel", rt::kernel_description()},
                     {"host", rt::host_description()},
                     {"scheduler", scheduler_text(run)},
                     {"real_time", run.real_time},
                     {"mode_note", run.note},
                     {"seed", run.options.seed},
                     {"exit_reason", run.exit_reason},
                     {"camera", camera_text(run)}};
  char stamp[40];
  const std::time_t now = std::time(nullptr);
  std::strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S%z", std::localtime(&now));
  doc["started"] = stamp;
  if (!summary.autopilot.empty()) doc["autopilot"] = summary.autopilot;
  if (run.options.faults)
    doc["faults"] = "socket " + fault_socket(run).string() +
                    (run.options.fault_timeline.empty() ? "" : ", timeline " + run.options.fault_timeline);
  for (const auto& p : phases)
    doc["phases"].push_back(
        {{"name", p.name}, {"setpoint_m", p.setpoint_m}, {"start_ns", p.start_ns}, {"end_ns", p.end_ns}});
  for (const auto& r : results) doc["results"].push_back(to_json(r));
  return doc;
}

/// Figures and bars of a mission, from the program that also judges campaigns (missions/judge.h).
std::vector<Result> judged_by_mission(const Run& run) {
  const fs::path answer = run.folder / "log/judge.txt";
  std::vector<std::string> arguments{program("wasp-judge"), run.options.mission, run.folder.string(), "--seed",
                                     std::to_string(run.options.seed)};
  if (!run.options.config.empty()) arguments.insert(arguments.end(), {"--config", run.options.config});
  if (!run.options.world.empty()) arguments.insert(arguments.end(), {"--world", run.options.world});
  ChildProcess judge(arguments, answer.string());
  const TimeNs deadline = rt::now() + 600 * kSecond;
  while (!judge.poll() && rt::now() < deadline) rt::sleep_until(rt::now() + 10 * kMillisecond);
  std::vector<Result> results;
  std::ifstream file(answer);
  for (std::string line; std::getline(file, line);)
    if (const auto doc = nlohmann::json::parse(line, nullptr, false); !doc.is_discarded() && doc.is_object())
      results.push_back(result_from_json(doc));
  if (results.empty()) results.push_back({"flight judged, see log/judge.txt", 0, "", "== 1", false});
  return results;
}

/// What this mission must show beyond being flown to its end. One that was cut short, by an interrupt or by --seconds,
/// is reported but not judged: nobody flies 60 m in ten seconds.
std::vector<Result> mission_results(const Run& run, const std::vector<Phase>& phases, bool cut_short) {
  if (!run.options.replay.empty() || flies_configured_autopilot(run)) return {};  // nobody knows the truth
  if (run.options.mission == "hover") return hover_results(run.folder / "log", phases);
  auto results = judged_by_mission(run);
  if (cut_short || run.options.seconds > 0)
    for (Result& r : results) r.bar.clear(), r.ok = true;
  return results;
}

std::vector<Result> judge(const Run& run, int flight_code, const std::vector<Phase>& phases,
                          const RunSummary& summary) {
  std::vector<Result> results;
  const bool ended_short = flight_code == kEndedShort;  // neither a success nor a failure
  results.push_back({"flight process exit code", static_cast<double>(flight_code), "", ended_short ? "" : "== 0",
                     ended_short || flight_code == 0});
  results.push_back({"mission flown to its end", summary.mission_result == 1 ? 1.0 : 0.0, "", ended_short ? "" : "== 1",
                     ended_short || summary.mission_result == 1});
  results.push_back(
      {"control ticks commanded by behaviours", static_cast<double>(summary.behaviour_ticks), "", "", true});
  for (auto& r : mission_results(run, phases, ended_short)) results.push_back(std::move(r));
  for (auto& r : timing_results(summary, allowed_share(run))) results.push_back(std::move(r));
  return results;
}

}  // namespace

int conclude(Run& run, int flight_code, bool interrupted) {
  std::vector<StageSummary> stages;
  RunSummary summary;
  if (std::ifstream file(run.folder / "log/stages.json"); file) {
    const auto doc = nlohmann::json::parse(file, nullptr, false);
    if (!doc.is_discarded()) {
      stages = stages_from_json(doc);
      summary = run_from_json(doc);
    }
  }
  const bool in_order = flight_code == 0 || flight_code == kEndedShort;
  run.exit_reason = interrupted && in_order ? "interrupted by the user, landed in order"
                    : interrupted
                        ? fmt::format("interrupted by the user; flight process ended with code {}", flight_code)
                    : flight_code == 0 ? "mission ended in order"
                    : in_order         ? "mission ended in order, but short of its purpose: see log/flight.txt"
                                       : fmt::format("flight process ended with code {}", flight_code);
  const auto phases = read_phases(run.folder / "log");
  const auto results = judge(run, flight_code, phases, summary);
  write_text(run.folder / "run.json", run_document(run, phases, results, summary).dump(1) + "\n");
  ChildProcess report({program("wasp-report"), run.folder.string()}, (run.folder / "log/report.txt").string());
  const TimeNs deadline = rt::now() + 120 * kSecond;
  while (!report.poll() && rt::now() < deadline) rt::sleep_until(rt::now() + 10 * kMillisecond);

  bool ok = true;
  if (!run.options.json)
    std::cout << latency_table(
        stages, rt::kernel_description() + ", " + scheduler_text(run) + ", " + rt::host_description(), run.real_time);
  for (const auto& r : results) {
    ok = ok && r.ok;
    if (run.options.json) {
      auto line = to_json(r);
      line["real_time"] = run.real_time;
      std::cout << line.dump() << "\n";
    } else {
      std::cout << fmt::format("{:<4} {:<48} {:>10.4g} {:<2} {}\n",
                               r.bar.empty() ? ""
                               : r.ok        ? "ok"
                                             : "MISS",
                               r.name, r.value, r.unit, r.bar.empty() ? "" : "bar " + r.bar);
    }
  }
  if (flight_code != 0)
    if (std::ifstream log(run.folder / "log/flight.txt"); log) std::cerr << log.rdbuf();
  const bool ended_short = flight_code == kEndedShort;
  if (!run.options.json)
    std::cout << (!ok           ? "MISSION FAILED"
                  : ended_short ? "MISSION NOT COMPLETED"
                                : "mission succeeded")
              << "; report: " << (run.folder / "report.html").string() << "\n";
  return !ok ? 1 : ended_short ? kEndedShort : 0;
}

}  // namespace wasp::tools
