// `wasp faults`: every fault of the catalogue, in every phase of a flight it applies to, done for real to a flight of
// its own; the answer measured on the serial line by this program, which is no part of the flight.
#include <fmt/format.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <fstream>
#include <iostream>

#include "faults/campaign.h"
#include "faults/negative.h"
#include "faults/result_table.h"
#include "faults/soak.h"
#include "rt/clock.h"
#include "shm/bus_guard.h"
#include "tools/progress_line.h"

namespace wasp::faults {
namespace {

std::atomic<bool> stop_requested{false};

struct Options {
  CampaignOptions campaign;
  std::string phase, json;
  bool list = false, negative = false, untimed = false, own_machine = false, no_guardian = false, no_rt = false;
  int class_number = 0;
  double soak_s = 0;
};

const std::map<std::string, Phase> kPhaseNames = {{"idle", Phase::kIdle},
                                                  {"take-off", Phase::kTakeOff},
                                                  {"hover", Phase::kHover},
                                                  {"cruise", Phase::kCruise},
                                                  {"landing", Phase::kLanding}};

void declare(CLI::App& app, Options& o) {
  app.name("wasp faults");
  app.option_defaults()->always_capture_default();
  app.add_flag("--list", o.list, "only print the catalogue: fault, class, what is promised, phases");
  app.add_option("--only", o.campaign.only, "faults whose name matches this regular expression");
  app.add_option("--class", o.class_number, "faults of this class, 1 ... 18 (0: all)")->check(CLI::Range(0, 18));
  app.add_option("--phase", o.phase, "in this phase only: idle, take-off, hover, cruise, landing")
      ->check(CLI::IsMember(kPhaseNames));
  app.add_option("--seeds", o.campaign.seeds, "repeat everything with so many seeds of world, noise and moment")
      ->check(CLI::Range(1, 1000));
  app.add_flag("--short", o.campaign.short_set,
               "a dozen faults in one phase each, times not judged: only whether detection, answer and recovery came "
               "and the wire stayed within its limits");
  app.add_flag("--untimed", o.untimed, "times are not judged: for machines whose times mean nothing");
  app.add_flag("--isolate", o.campaign.isolate, "a flight for each fault, none shared");
  app.add_flag("--negative", o.negative,
               "negative controls: flights weakened on purpose, whose cells must come out as MISS");
  app.add_option(
         "--soak", o.soak_s,
         "instead: one flight of so many seconds, recoverable faults at random; memory, descriptors and latency "
         "must stay flat")
      ->check(CLI::Range(120.0, 86400.0));
  app.add_flag("--no-guardian", o.no_guardian, "fly without it");
  app.add_flag("--no-rt", o.no_rt, "fly without real time");
  app.add_option("--replay", o.campaign.replay,
                 "fly on this recording instead of the simulated camera, in hover only: where nothing can render")
      ->check(CLI::ExistingDirectory);
  app.add_flag("--own-machine", o.own_machine,
               "this machine is nobody else's: its clock, cores and limits may be changed");
  app.add_option("--out", o.campaign.out, "folder for the flights' files");
  app.add_option("--json", o.json, "write all results to this file");
}

/// How long the rest will take if it goes on as until now.
std::string remaining(TimeNs began_ns, std::size_t done, std::size_t of) {
  const double each_s = to_seconds(rt::now() - began_ns) / static_cast<double>(std::max<std::size_t>(done, 1));
  return fmt::format("{} of {} cells, {:.0f} s remain", done, of, each_s * static_cast<double>(of - done));
}

int fly(const Options& o) {
  Abilities abilities = find_abilities();
  abilities.own_machine = o.own_machine;
  abilities.replay = !o.campaign.replay.empty();
  if (o.no_rt) abilities.real_time = false;
  if (!abilities.real_time) std::cout << "NOT REAL TIME: no time of this run says anything of a flight that is\n";
  CampaignOptions campaign = o.campaign;
  campaign.times = !campaign.short_set && !o.untimed;
  campaign.guarded = !o.no_guardian;
  if (o.no_guardian) abilities.guardian = false;
  if (o.soak_s > 0)
    return run_soak({o.soak_s, static_cast<std::uint32_t>(o.campaign.seeds), o.campaign.out}, abilities,
                    [] { return stop_requested.load(); });
  tools::ProgressLine line("faults");
  const TimeNs began_ns = rt::now();
  CampaignHooks hooks;
  hooks.interrupted = [] { return stop_requested.load(); };
  hooks.tried = [&](std::size_t tried, std::size_t of) { line.show(remaining(began_ns, tried, of), tried == of); };
  hooks.judged = [](const CellResult& result) { std::cout << table_row(result) << "\n" << std::flush; };
  if (o.negative) return run_negative(campaign, abilities, hooks);
  std::cout << table_head() << "\n" << std::flush;
  const std::vector<CellResult> results = run_campaign(campaign, abilities, hooks);
  std::cout << table_foot(results);
  if (!o.json.empty()) {
    std::ofstream file(o.json);
    file << to_json(results, abilities) << "\n";
    if (!file.flush()) throw std::runtime_error("cannot write " + o.json);
  }
  if (stop_requested) std::cout << "interrupted\n";
  const bool kept = std::ranges::none_of(results, [](const CellResult& r) { return r.verdict == Verdict::kMiss; });
  return !kept ? 1 : stop_requested ? 4 : 0;
}

}  // namespace
}  // namespace wasp::faults

int main(int argc, char** argv) {
  using namespace wasp::faults;
  CLI::App app{
      "Does every fault of the catalogue to flights in the simulator and measures the answer on the serial line.\n"
      "Exit code 0: every promise was kept (host noise, where the machine itself stood still, is reported apart);\n"
      "1: a promise was broken; 2: bad arguments; 4: interrupted, nothing broken until then."};
  Options options;
  declare(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (options.class_number > 0) options.campaign.class_number = options.class_number;
  if (!options.campaign.replay.empty() && options.phase.empty()) options.phase = "hover";
  if (!options.phase.empty()) options.campaign.phase = kPhaseNames.at(options.phase);
  if (options.list) {
    std::cout << catalogue_list();
    return 0;
  }
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = true; };
  for (const int s : {SIGINT, SIGTERM, SIGHUP}) sigaction(s, &action, nullptr);
  wasp::shm::install_bus_guard();
  try {
    return fly(options);
  } catch (const std::exception& e) {
    std::cerr << "wasp faults: " << e.what() << "\n";
    return 1;
  }
}
