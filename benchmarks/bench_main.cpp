// wasp-bench: one row a benchmark.
#include <CLI/CLI.hpp>
#include <string_view>

#include "benchmarks/bench.h"
#include "benchmarks/latency_bench.h"

namespace {

struct Row {
  const char* name;
  const char* help;
  int (*run)(const wasp::bench::Options&);
};

constexpr Row kRows[] = {
    {"ipc", "a camera frame from process to process, beside iceoryx, pipe, futex, eventfd; observers; killed readers",
     wasp::bench::run_ipc},
    {"observers",
     "observers of a flight and a camera killed and frozen by the thousand: torn reads, leaked slots, timing",
     wasp::bench::run_observers},
    {"bridge", "control timing with and without the iceoryx gateway, killed and frozen at random beside the flight",
     wasp::bench::run_bridge},
    {"render", "frames of the simulated camera: worlds, sizes, lenses, antialiasing, defocus, motion blur",
     wasp::bench::run_render},
#ifdef WASP_HAVE_BENCHMARK
    {"micro",
     "histogram, seqlock, queue, ring, bell, MAVLink, control step, fault points that are off, first touch: one "
     "operation "
     "each (Google Benchmark)",
     wasp::bench::run_micro},
#endif
#ifdef WASP_HAVE_OPENCV
    {"vision", "each vision kernel beside the library call it replaces, and beside the physical floor",
     wasp::bench::run_vision},
#endif
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Benchmarks of wasp", "wasp-bench"};
  app.require_subcommand(1);
  wasp::bench::Options options;
  const Row* chosen = nullptr;
  for (const Row& row : kRows) {
    CLI::App* command = app.add_subcommand(row.name, row.help);
    command->add_flag("--json", options.json, "one JSON object a line");
    command->add_option("--seconds", options.seconds, "about how long to measure")->check(CLI::Range(1.0, 3600.0));
    if (row.name == std::string_view("observers"))
      command->add_option("--kills", options.kills, "how many observers die; some 30 ms each")
          ->check(CLI::Range(1, 1'000'000));
    if (row.name == std::string_view("vision") || row.name == std::string_view("render"))
      command->add_option("--only", options.only, "only rows whose name contains this");
    command->callback([&chosen, &row] { chosen = &row; });
  }
  wasp::bench::LatencyOptions latency;
  CLI::App* latency_command = app.add_subcommand(
      "latency", "the flight in the simulator, idle and under load, beside cyclictest; exposure to the last byte");
  wasp::bench::declare_latency(*latency_command, latency);
  CLI11_PARSE(app, argc, argv);
  if (latency_command->parsed()) return wasp::bench::run_latency(latency);
  return chosen->run(options);
}
