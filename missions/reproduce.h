// The thesis' experiments, all of them, again: which missions, how many flights, which of its figures they stand for
// and what it said of them; and the one page that shows ours beside that.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "missions/campaign.h"
#include "missions/run_figures.h"

namespace wasp::missions {

/// One row of the list of experiments.
struct Experiment {
  const char* mission;
  int runs, quick_runs;
  const char* title;
  const char* thesis_figures;  ///< e.g. "fig. 7.19"
  const char* thesis_result;   ///< its own words, or a summary of them
};
const std::vector<Experiment>& experiments();

/// What an experiment came to: a campaign, or (for the edge study) tables alone.
struct ExperimentResult {
  const Experiment* experiment = nullptr;
  CampaignResult campaign;
  std::vector<std::pair<std::string, std::string>> figures;  ///< caption, SVG element
  std::vector<std::string> remarks;
};

/// The page, with style and figures inside it.
std::string reproduction_page(const std::vector<ExperimentResult>& results, const std::string& machine);

}  // namespace wasp::missions
