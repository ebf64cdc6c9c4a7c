#include "scheduling/plan.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "scheduling/admission.h"
#include "scheduling/schedule_picture.h"

namespace wasp::scheduling {
namespace {

double milliseconds(DurationNs ns) { return static_cast<double>(ns) / kMillisecond; }

std::string core_text(int core) { return core < 0 ? "any" : std::to_string(core); }

std::string row_text(const PlanRow& row) {
  const AnalysedThread& t = row.thread;
  const ResponseTime& r = row.response;
  return fmt::format("{:<18} {:>4} {:>4} {:>9.3f} {:>9.3f} {:>9.3f} {:<10} {:>8.3f} {:>1}{:>9.3f} {:>9}  {}\n", t.name,
                     core_text(t.core), t.priority, milliseconds(t.period_ns), milliseconds(t.deadline_ns),
                     milliseconds(t.cost_ns), row.measured ? "measured" : "configured", milliseconds(t.blocking_ns),
                     r.bounded ? "" : ">", milliseconds(r.response_ns),
                     r.bounded ? fmt::format("{:.3f}", milliseconds(t.deadline_ns - r.response_ns)) : "-",
                     r.meets_deadline ? "yes" : "NO");
}

/// Every thread that can run on `core`, and how long the picture must be to show the longest response.
std::string core_picture(const Plan& plan, int core) {
  std::vector<AnalysedThread> threads;
  DurationNs length_ns = kMillisecond;
  for (const auto& row : plan.rows)
    if (row.thread.core == core || row.thread.core < 0) {
      threads.push_back(row.thread);
      length_ns = std::max(length_ns, row.response.bounded ? row.response.response_ns * 5 / 4 : row.thread.deadline_ns);
    }
  return fmt::format("\ncore {}, {:.1f} % used; all released together at 0 (# runs, - waits, ^ released):\n{}",
                     core_text(core), 100 * utilisation(threads, core), schedule_picture(threads, length_ns));
}

}  // namespace

std::string plan_text(const Plan& plan) {
  std::string text =
      fmt::format("{:<18} {:>4} {:>4} {:>9} {:>9} {:>9} {:<10} {:>8} {:>10} {:>9}  {}\n", "thread", "core", "prio",
                  "T [ms]", "D [ms]", "C [ms]", "C is", "B [ms]", "R [ms]", "slack", "in time");
  for (const auto& row : plan.rows) text += row_text(row);
  for (const int core : plan.cores) text += core_picture(plan, core);
  text += plan.schedulable ? "\nschedulable: every thread ends before its deadline, whatever the phases\n"
                           : "\nNOT schedulable:\n";
  for (const auto& reason : plan.reasons) text += "  " + reason + "\n";
  return text;
}

int plan_main(const BehaviourTable& behaviours, int argc, char** argv) {
  std::vector<std::string> configs;
  std::string measured;
  bool json = false, replay = false;
  CLI::App app{
      "Says before any flight whether the thread table can keep its deadlines: the response time R of every thread\n"
      "from its period T, deadline D, cost C, blocking B and the threads that may delay it (docs/timing.md).\n"
      "Exit code 0: schedulable; 1: not, or an error; 2: bad arguments."};
  app.name("wasp plan");
  app.add_option("--config", configs, "TOML files in order, later ones override single keys")->check(CLI::ExistingFile);
  app.add_option("--measured", measured, "log/stages.json of an earlier flight: its maxima in the place of budgets")
      ->check(CLI::ExistingFile);
  app.add_flag("--replay", replay, "with the thread that plays a recording");
  app.add_flag("--json", json, "one JSON object");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  try {
    Config config = load_config(configs, names_of(behaviours));
    if (replay) disable_without_stream(behaviours, {shm::kGray, shm::kDepth}, config);
    check_streams(behaviours, config);
    const Plan plan = make_plan(config, from_seconds(1.0 / config.camera_rate_hz),
                                replay || is_device(config.camera_driver),
                                measured.empty() ? MeasuredCosts{} : read_measured_costs(measured));
    std::fputs((json ? plan_json(plan) + "\n" : plan_text(plan)).c_str(), stdout);
    return plan.schedulable ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "wasp plan: %s\n", e.what());
    return 1;
  }
}

}  // namespace wasp::scheduling
