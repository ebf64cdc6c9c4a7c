// What `wasp bench latency` prints and writes: a line a pair, a verdict a load, the worst chain of every behaviour,
// JSON, and pictures.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "benchmarks/latency_judge.h"

namespace wasp::bench {

/// All pairs of a run, and what was concluded for each load.
struct LatencyRun {
  std::vector<PairFigures> pairs;
  std::vector<LoadVerdict> verdicts;
  double seconds = 0;    ///< of a pair
  bool binding = false;  ///< the bars apply
};

std::string pair_text(const PairFigures& pair);
/// Verdict and tables of one load.
std::string load_text(const LatencyRun& run, const LoadVerdict& verdict);
nlohmann::json latency_run_json(const LatencyRun& run);
/// True if every bar that applies is met.
bool all_met(const LatencyRun& run);

/// Writes latency.html and one SVG a figure. Throws std::runtime_error naming a path that cannot be written.
void write_plots(const LatencyRun& run, const std::filesystem::path& folder);

}  // namespace wasp::bench
