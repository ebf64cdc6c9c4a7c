// Figures of one pair, and the verdict over the pairs of a load: ratios to the reference that ran at the same time, on
// the same core, with the same period, at the next priority; the median over the pairs is judged.
#pragma once

#include <string>
#include <vector>

#include "benchmarks/latency_chain.h"
#include "benchmarks/latency_misses.h"
#include "tools/result.h"

namespace wasp::bench {

struct PairFigures {
  PairSetup setup;
  tools::Population ours, theirs;  ///< wake-up latencies, every release of both within one window
  tools::Quantiles q_ours, q_theirs, q_witness;
  double ratio_p50 = 0, ratio_p99 = 0, ratio_p999 = 0, ratio_max = 0;
  double ratio_max_allowed = 0;  ///< (max - 0.2 ms) / reference's max: the quantity with a bar of 1.5
  std::vector<Miss> misses;
  std::set<std::string> foreign;  ///< PairData::foreign
  bool judgeable = false;  ///< the reference's own maximum stays below the slack and nobody else's real-time thread
                           ///< shared the core: then no miss is allowed
  std::vector<BehaviourChains> behaviours;
  std::vector<StageFigures> stages;
  std::size_t lost = 0;
  std::uint64_t minor_faults = 0, major_faults = 0;
};

PairFigures judge_pair(const PairData& pair);

struct LoadVerdict {
  std::string load;
  std::vector<tools::Result> results;  ///< with their bars
  std::size_t misses = 0, host_noise = 0, judgeable_pairs = 0, misses_in_judgeable = 0;
};
/// Bars apply to 5 pairs or more of 2 minutes or more; fewer or shorter ones are reported without (`binding` false).
LoadVerdict judge_load(const std::vector<const PairFigures*>& pairs, bool binding);

}  // namespace wasp::bench
