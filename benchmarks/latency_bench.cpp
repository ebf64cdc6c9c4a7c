// wasp bench latency: the flight binary in the simulator, idle and under stress-ng, beside cyclictest on the same core
// at the same time. Prints ratios, every stage from exposure to the serial byte, and who is to blame for a miss.
#include "benchmarks/latency_bench.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>

#include "benchmarks/child.h"
#include "benchmarks/latency_pair.h"
#include "benchmarks/latency_report.h"
#include "rt/clock.h"
#include "rt/process.h"
#include "tools/flight_config.h"
#include "tools/wakeup_loop.h"

namespace wasp::bench {
namespace {

constexpr double kOverhead_s = 9;  // of a pair: take-off, settling, landing; for the time left only

class Progress {
 public:
  Progress(const LatencyOptions& o, std::size_t total) : seconds_(o.seconds), total_(total) {}
  void operator()(const std::string& load, std::size_t done, double in_pair_s, std::int64_t late_ns) {
    const bool terminal = isatty(STDERR_FILENO) != 0;
    if (!terminal && rt::now() - told_ns_ < 15 * kSecond) return;
    told_ns_ = rt::now();
    const double left_s = static_cast<double>(total_ - done) * (seconds_ + kOverhead_s) - in_pair_s;
    std::cerr << fmt::format("{}[{}/{}] {}: {:.0f} of {:.0f} s, about {:.1f} min left; last wake-up {}{}",
                             terminal ? "\r\033[K" : "", done + 1, total_, load, in_pair_s, seconds_,
                             std::max(0.0, left_s) / 60, tools::duration_text(late_ns), terminal ? "" : "\n")
              << std::flush;
  }
  static void end_line() {
    if (isatty(STDERR_FILENO) != 0) std::cerr << "\r\033[K" << std::flush;
  }

 private:
  double seconds_;
  std::size_t total_;
  TimeNs told_ns_ = 0;
};

/// One pair more; false if it failed or was interrupted: what was measured before is kept.
bool measure_pair(const LatencyOptions& options, const scheduling::Config& config, const PairSetup& setup,
                  Progress& progress, LatencyRun& run) {
  const std::size_t done = run.pairs.size();
  try {
    run.pairs.push_back(judge_pair(run_pair(setup, options, config, [&](double seconds, std::int64_t late_ns) {
      progress(setup.load, done, seconds, late_ns);
    })));
  } catch (const std::exception& e) {
    Progress::end_line();
    std::cerr << "wasp bench latency: " << e.what() << "\n";
    return false;
  }
  Progress::end_line();
  std::cout << pair_text(run.pairs.back()) << std::flush;
  return true;
}

/// Pairs in turns over the loads, so that a noisy hour strikes all alike; false if it ended early.
bool measure(const LatencyOptions& options, const scheduling::Config& config, LatencyRun& run) {
  Progress progress(options, options.loads.size() * static_cast<std::size_t>(options.pairs));
  for (int i = 0; i < options.pairs; ++i)
    for (const auto& load : options.loads)
      if (interrupted() || !measure_pair(options, config, setup_of(load, i, config), progress, run)) return false;
  return true;
}

void conclude(const LatencyOptions& options, LatencyRun& run) {
  for (const auto& load : options.loads) {
    std::vector<const PairFigures*> pairs;
    for (const auto& p : run.pairs)
      if (p.setup.load == load) pairs.push_back(&p);
    if (!pairs.empty()) run.verdicts.push_back(judge_load(pairs, run.binding));
  }
  for (const auto& v : run.verdicts) std::cout << "\n" << load_text(run, v);
  if (!run.binding)
    std::cout << "\nThe bars on ratios apply to 5 pairs of 2 minutes (--full): the 99.9 % quantile of fewer than 1000\n"
                 "samples is their maximum.\n";
  if (!options.json.empty()) {
    std::ofstream out(options.json);
    out << latency_run_json(run).dump(1) << "\n";
    if (!out.flush()) throw std::runtime_error("cannot write " + options.json);
  }
  if (!options.plots.empty()) write_plots(run, options.plots);
}

}  // namespace

int run_latency(const LatencyOptions& options) {
  catch_interrupts();
  try {
    if (options.contract) return run_contract(options);
    const auto config = tools::read_flight_config(options.config);
    LatencyRun run;
    run.seconds = options.seconds;
    run.binding = options.binding();
    tools::lock_what_is_mapped();
    std::cout << rt::kernel_description() << ", " << rt::host_description() << "\n" << std::flush;
    const bool whole = measure(options, config, run);
    run.binding = run.binding && whole;
    if (!run.pairs.empty()) conclude(options, run);
    if (!whole) return 2;
    return all_met(run) ? 0 : 1;
  } catch (const std::exception& e) {
    std::cerr << "wasp bench latency: " << e.what() << "\n";
    return 2;
  }
}

}  // namespace wasp::bench
