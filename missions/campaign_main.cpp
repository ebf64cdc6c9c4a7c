// wasp-campaign: many flights of one mission in lockstep on virtual time; a table of figures against their bars, a line
// a flight in CSV, and any flight again by its seed.
#include <fmt/format.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <fstream>
#include <iostream>
#include <stdexcept>

#include "missions/campaign.h"
#include "tools/progress_line.h"
#include "missions/run_figures.h"

namespace {

using namespace wasp;
using namespace wasp::missions;
namespace fs = std::filesystem;

struct Options {
  CampaignOptions campaign;
  std::optional<std::uint32_t> only_seed;
  fs::path out;
  bool json = false, list = false;
};

std::optional<int> parse(int argc, char** argv, Options& o) {
  CLI::App app{
      "Flies a mission many times in lockstep on virtual time, each time with another seed, and holds the figures\n"
      "against the mission's bars. Exit code 0: every bar met; 1: one missed, or a flight could not be flown; 2: bad "
      "arguments."};
  app.name("wasp campaign");
  app.option_defaults()->always_capture_default();
  app.add_option("MISSION", o.campaign.mission, "a folder of config/missions; --list names them");
  app.add_option("--runs", o.campaign.runs, "flights")->check(CLI::Range(1, 1'000'000));
  app.add_option("--seed", o.campaign.first_seed, "of the first flight; each further one has the next");
  app.add_option(
      "--only", o.only_seed,
      "fly this seed alone, the same to the bit as in a campaign; with --out its trace and cues are kept too");
  app.add_option("--jobs", o.campaign.jobs, "threads")->check(CLI::Range(1, 256));
  app.add_option("--config", o.campaign.configs, "further flight configuration, read last")->check(CLI::ExistingFile);
  app.add_option("--out", o.out, "folder for runs.csv and figures (default: none is written)");
  app.add_flag("--json", o.json, "results as JSON, one object a line");
  app.add_flag("--list", o.list, "names of the missions");
  try {
    app.parse(argc, argv);
    if (!o.list && o.campaign.mission.empty()) throw CLI::RequiredError("MISSION");
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (o.only_seed) o.campaign.first_seed = *o.only_seed, o.campaign.runs = 1;
  return std::nullopt;
}

void print_results(const CampaignResult& result, bool json) {
  for (const auto& r : result.results) {
    if (json)
      std::cout << tools::to_json(r).dump() << "\n";
    else
      std::cout << fmt::format("{:<4} {:<48} {:>10.4g} {:<5} {}\n",
                               r.bar.empty() ? ""
                               : r.ok        ? "ok"
                                             : "MISS",
                               r.name, r.value, r.unit, r.bar.empty() ? "" : "bar " + r.bar);
  }
  for (const auto& run : result.runs)
    if (!run.error.empty()) std::cerr << fmt::format("seed {}: {}\n", run.seed, run.error);
  if (!json)
    std::cout << fmt::format("{} flights, {:.0f} s of flight in {:.1f} s: {:.1f} x real time\n", result.runs.size(),
                             result.flown_s(), result.wall_s, result.speed_up());
}

int run(const Options& o) {
  if (o.list) {
    for (const auto& name : mission_names()) std::cout << name << "\n";
    return 0;
  }
  if (!o.out.empty()) fs::create_directories(o.out);
  tools::ProgressLine line(o.campaign.mission);
  const auto progress = [&](const CampaignProgress& p) { line.show(progress_text(p), p.done == p.runs); };
  RunFigures figures(o.campaign.mission);
  const CampaignResult result =
      fly_campaign(o.campaign, progress, [&](std::uint32_t seed, const FlightTrace& trace, const WorldProbe& probe) {
        if (!o.out.empty()) figures.add(seed, trace, probe);
        if (o.out.empty() || !o.only_seed) return;
        write_trace_csv(trace, probe, o.out / fmt::format("trace-{}.csv", seed));
        write_cues_csv(trace, o.out / fmt::format("cues-{}.csv", seed));
      });
  print_results(result, o.json);
  if (!o.out.empty()) {
    write_csv(result, o.out / "runs.csv");
    figures.write(o.out);
    std::cerr << fmt::format("{} written\n", o.out.string());
  }
  return result.passed() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (const auto code = parse(argc, argv, options)) return *code;
  try {
    return run(options);
  } catch (const std::exception& e) {
    std::cerr << "wasp campaign: " << e.what() << "\n";
    return 2;
  }
}
