#include "benchmarks/latency_options.h"

#include <CLI/CLI.hpp>

namespace wasp::bench {

void declare_latency(CLI::App& command, LatencyOptions& o) {
  command.option_defaults()->always_capture_default();
  auto* seconds = command.add_option("--seconds", o.seconds, "length of one pair; with --contract of the flight")
                      ->check(CLI::Range(2.0, 36000.0));
  auto* pairs = command.add_option("--pairs", o.pairs, "pairs per load")->check(CLI::Range(1, 1000));
  command.add_option("--load", o.loads, "what stress-ng does meanwhile")
      ->delimiter(',')
      ->check(CLI::IsMember({"idle", "cpu", "memory", "io"}));
  command.add_option("--json", o.json, "write every figure to this file");
  command.add_option("--plots", o.plots, "write figures (SVG) and latency.html into this folder");
  command.add_option("--config", o.config, "TOML file whose keys override the flight's defaults")
      ->check(CLI::ExistingFile);
  command.add_flag("--full", o.full, "5 pairs of 2 minutes per load: the bars apply")
      ->excludes(seconds)
      ->excludes(pairs);
  command.add_flag("--contract", o.contract,
                   "instead: fly with a guarded allocator and count allocations and page faults in real-time threads");
  command.add_flag("--no-rt", o.no_rt, "ordinary scheduling; every figure is marked");
  command.parse_complete_callback([&o] {
    if (!o.full) return;
    o.seconds = 120;
    o.pairs = 5;
  });
}

}  // namespace wasp::bench
