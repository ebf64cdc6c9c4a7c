// wasp-reproduce: flies every experiment of the thesis in lockstep, and writes one page with a figure for each of its
// figures, its result quoted beside ours.
#include <fmt/format.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <stdexcept>

#include "tools/progress_line.h"
#include "missions/reproduce.h"
#include "rt/process.h"
#include "tools/edge_study.h"

namespace {

using namespace wasp;
using namespace wasp::missions;
namespace fs = std::filesystem;

struct Options {
  fs::path out = "out/reproduce";
  std::vector<std::string> only;
  std::uint32_t seed = 1;
  int jobs = 2;
  bool quick = false;
};

std::optional<int> parse(int argc, char** argv, Options& o) {
  CLI::App app{
      "Flies every experiment of the thesis in lockstep on virtual time and writes OUT/index.html, a CSV and the "
      "figures\n"
      "of each. About an hour on two cores; --quick: a few flights of each, some minutes. Exit code 0: every bar met."};
  app.name("wasp reproduce");
  app.option_defaults()->always_capture_default();
  app.add_option("--out", o.out, "folder to write");
  app.add_option("--only", o.only, "these missions alone; 'edges': the study of edge statistics");
  app.add_option("--seed", o.seed, "of each experiment's first flight");
  app.add_option("--jobs", o.jobs, "threads")->check(CLI::Range(1, 256));
  app.add_flag("--quick", o.quick, "a few flights of each");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

ExperimentResult fly_experiment(const Experiment& e, const Options& o) {
  ExperimentResult result;
  result.experiment = &e;
  RunFigures figures(e.mission);
  tools::ProgressLine line(e.mission);
  CampaignOptions campaign{e.mission, o.quick ? e.quick_runs : e.runs, o.seed, o.jobs, {}};
  result.campaign = fly_campaign(
      campaign, [&](const CampaignProgress& p) { line.show(progress_text(p), p.done == p.runs); },
      [&](std::uint32_t seed, const FlightTrace& trace, const WorldProbe& probe) { figures.add(seed, trace, probe); });
  write_csv(result.campaign, o.out / (std::string(e.mission) + ".csv"));
  figures.write(o.out);
  for (const Figure& f : figures.figures()) result.figures.emplace_back(f.title, f.plot.svg());
  return result;
}

ExperimentResult study_edges(const Options& o) {
  static const Experiment kEdges{"edges",
                                 0,
                                 0,
                                 "Height from edge statistics: three fields of view, lambda swept",
                                 "figs 7.8 to 7.12",
                                 "Lambda = 0.35 best estimates the height in the virtual world; a larger field of view "
                                 "under-estimates height with less variance."};
  tools::EdgeStudyOptions options;
  if (o.quick) options.seeds = 3, options.climbs = 2;
  tools::ProgressLine line("edges");
  options.progress = [&](int done, int of) { line.show(fmt::format("{} of {} images", done, of), done == of); };
  const tools::EdgeStudy study = tools::run_edge_study(options);
  tools::write_edge_study(study, o.out);
  ExperimentResult result;
  result.experiment = &kEdges;
  for (const auto& f : study.fits)
    result.campaign.results.push_back(
        {fmt::format("RMS height error by height, {} degrees, lambda {:.2f}", f.fov_deg, f.edges_per_m), f.rms_share,
         "", "", true});
  result.figures = {{"7.8: estimated against true height for several lambda", tools::edge_figure_7_8(study)},
                    {"7.10: estimated against true height, three fields of view", tools::edge_figure_7_10(study)},
                    {"7.11: row of most edges against height", tools::edge_figure_7_11(study)}};
  for (const double fov : options.fovs_deg) {
    result.figures.emplace_back(fmt::format("7.9: cumulative distribution and model, {} degrees", fov),
                                tools::edge_figure_7_9(study, fov));
    result.figures.emplace_back(fmt::format("7.12: modelled density, {} degrees", fov),
                                tools::edge_figure_7_12(study, fov));
  }
  result.figures.emplace_back("Lambda found from climbs (8.1.3)", tools::edge_figure_lambda(study));
  return result;
}

const ExperimentResult* find(const std::vector<ExperimentResult>& results, const std::string& mission) {
  for (const auto& r : results)
    if (mission == r.experiment->mission) return &r;
  return nullptr;
}

/// What no flight shows alone: near-peak flies lower over the obstacles than maximum peak; the campaign is fast.
void compare(std::vector<ExperimentResult>& results, const Options& o) {
  constexpr double kWellBelow = 0.7, kLeastSpeedUp = 10;
  const auto* all = find(results, "city-max");
  const auto mean_over = [](const ExperimentResult& r) {
    double sum = 0;
    for (const auto& run : r.campaign.runs) sum += value_of(run.measures, "mean height over obstacles");
    return sum / static_cast<double>(r.campaign.runs.size());
  };
  for (auto& r : results) {
    const std::string_view mission = r.experiment->mission;
    if (!mission.starts_with("city")) continue;
    if (all != nullptr && &r != all) {
      const double share = mean_over(r) / mean_over(*all);
      const bool judged = mission == "city-near";
      r.campaign.results.push_back({"mean height over obstacles, share of maximum peak's", share, "",
                                    judged ? fmt::format("<= {}", kWellBelow) : "", !judged || share <= kWellBelow});
      if (!judged && share > kWellBelow)
        r.remarks.push_back(
            "Defocus does not tell near from far here: roofs against the bright sky stay strong edges when blurred.");
    }
    if (!o.quick && o.jobs >= 2)
      r.campaign.results.push_back({"speed of the campaign", r.campaign.speed_up(), "x real time",
                                    fmt::format(">= {}", kLeastSpeedUp), r.campaign.speed_up() >= kLeastSpeedUp});
  }
}

void print(const ExperimentResult& r) {
  for (const auto& x : r.campaign.results)
    std::cout << fmt::format("{:<4} {:<16} {:<52} {:>10.4g} {:<12} {}\n",
                             x.bar.empty() ? ""
                             : x.ok        ? "ok"
                                           : "MISS",
                             r.experiment->mission, x.name, x.value, x.unit, x.bar.empty() ? "" : "bar " + x.bar);
  std::cout << std::flush;
}

int run(const Options& o) {
  fs::create_directories(o.out);
  const auto wanted = [&](const std::string& name) {
    return o.only.empty() || std::find(o.only.begin(), o.only.end(), name) != o.only.end();
  };
  for (const auto& name : o.only)
    if (name != "edges" &&
        std::none_of(experiments().begin(), experiments().end(), [&](const auto& e) { return name == e.mission; }))
      throw std::runtime_error("no experiment '" + name + "'");
  std::vector<ExperimentResult> results;
  if (wanted("edges")) results.push_back(study_edges(o));
  for (const Experiment& e : experiments())
    if (wanted(e.mission) && (!o.quick || e.quick_runs > 0)) results.push_back(fly_experiment(e, o));
  if (results.empty()) throw std::runtime_error("nothing to fly: --quick leaves out what was asked for");
  compare(results, o);
  for (const auto& r : results) print(r);
  const bool ok = std::all_of(results.begin(), results.end(), [](const auto& r) { return r.campaign.passed(); });
  std::ofstream page(o.out / "index.html");
  page << reproduction_page(results, rt::host_description());
  if (!page.flush()) throw std::runtime_error("cannot write " + (o.out / "index.html").string());
  std::cout << (ok ? "every bar met" : "BARS MISSED") << "; report: " << (o.out / "index.html").string() << "\n";
  return ok ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (const auto code = parse(argc, argv, options)) return *code;
  try {
    return run(options);
  } catch (const std::exception& e) {
    std::cerr << "wasp reproduce: " << e.what() << "\n";
    return 2;
  }
}
