// The command line of `wasp bench latency`.
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace wasp::bench {

struct LatencyOptions {
  double seconds = 15;  ///< of one pair
  int pairs = 2;        ///< per load
  std::vector<std::string> loads = {"idle", "cpu", "memory", "io"};
  std::string json, plots, config;
  bool full = false;      ///< 5 pairs of 2 minutes: the bars apply
  bool contract = false;  ///< instead: allocations and page faults of a flight
  bool no_rt = false;     ///< ordinary scheduling; for tests and for machines without the right

  /// The bars apply to runs this long only: the 99.9 % quantile of fewer samples is their maximum.
  [[nodiscard]] bool binding() const { return pairs >= 5 && seconds >= 120; }
};

void declare_latency(CLI::App& command, LatencyOptions& options);

}  // namespace wasp::bench
