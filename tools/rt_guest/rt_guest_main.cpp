// `wasp rt-guest`: the flight binary on a real PREEMPT_RT kernel without a board. Boots Debian's arm64 kernel in QEMU
// on virtual time, flies quiet, under stress-ng, and under stress-ng without real time (the negative control), all in
// one boot, and judges every figure.
#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <optional>

#include "rt/clock.h"
#include "tools/program_paths.h"
#include "tools/rt_guest/machine.h"
#include "tools/rt_guest/prepare.h"
#include "tools/rt_guest/progress.h"
#include "tools/rt_guest/report.h"
#include "tools/rt_guest/verdict.h"

namespace wasp::tools::rt_guest {
namespace {

namespace fs = std::filesystem;

constexpr int kUnavailable = 77;  // CTest: skipped

struct Options {
  std::string arch = "arm64", only, json;
  bool full = false, short_form = false, stress = false, faults = false, two_cores = false;
  std::int64_t cycles = 0, stress_cycles = 0;
  double patience_s = 600;
};

Plan plan_of(const Options& o) {
  if (o.faults) return plan_faults(o.arch, o.only);
  if (o.two_cores) return plan_two_cores(o.arch);
  Cycles cycles;
  if (o.full) cycles = {.quiet = 36'000, .stressed = 2'400, .not_real_time = 200};
  if (o.cycles > 0) cycles.quiet = o.cycles;
  if (o.stress) cycles.stressed = cycles.quiet;
  if (o.stress_cycles > 0) cycles.stressed = o.stress_cycles;
  return plan_boot(o.arch, cycles);
}

void print_results(const std::vector<Result>& results) {
  for (const Result& r : results)
    std::cout << fmt::format("{:<4} {:<52} {:>10.6g} {:<2} {}\n", r.ok ? "ok" : "MISS", r.name, r.value, r.unit,
                             "bar " + r.bar);
}

void print_logs(const Console& console) {
  for (const auto& [name, outcome] : console.outcomes())
    for (const auto& line : outcome.log) std::cerr << name << ": " << line << "\n";
  for (const auto& error : console.errors()) std::cerr << "guest: " << error << "\n";
}

/// The whole measurement; true if every bar is met.
bool print(const Plan& plan, const Console& console, const std::vector<Result>& results) {
  const bool ok = std::all_of(results.begin(), results.end(), [](const Result& r) { return r.ok; });
  std::cout << plan.arch << ", kernel " << console.kernel()
            << (plan.cores == 1 ? ", virtual time: 1 processor, 500 million instructions a second\n"
                                : ", 2 processors, no virtual time: no time is judged\n")
            << table(read_rows(plan, console.outcomes())) << "\n";
  print_results(results);
  if (!ok) print_logs(console);
  std::cout << (ok ? "all bars met\n" : "BARS MISSED\n");
  return ok;
}

int run(const Options& options) {
  const Plan plan = plan_of(options);
  const fs::path work = program_folder() / "rt_guest" / plan.arch;
  fs::create_directories(work);
  const RunLock lock(work / "lock");
  const Image image = prepare(plan, work);
  Progress progress(plan);
  const Console console =
      boot(plan.arch, image, work / "console.txt", options.patience_s, [&](const Console& c) { progress.show(c); });
  progress.finish();
  const auto results = judge(plan, console.outcomes());
  if (!options.json.empty()) {
    std::ofstream file(options.json);
    file << report_json(plan, image.kernel_package, console, results).dump(1) << "\n";
    if (!file.flush()) throw std::runtime_error("cannot write " + options.json);
  }
  return print(plan, console, results) ? 0 : 1;
}

std::optional<int> parse(int argc, char** argv, Options& o) {
  CLI::App app{
      "Flies the flight binary on Debian's PREEMPT_RT kernel in an emulator, and judges its timing.\n"
      "Exit code 0: all bars met; 1: a bar missed or the guest failed; 2: bad arguments; 77: cannot be had here."};
  app.name("wasp rt-guest");
  app.option_defaults()->always_capture_default();
  auto* full =
      app.add_flag("--full", o.full,
                   "36000 control cycles (30 virtual minutes), 2400 under stress-ng; 18 minutes of processor time");
  app.add_flag("--short", o.short_form,
               "300 control cycles, 200 under stress-ng, for continuous integration (the default)")
      ->excludes(full);
  app.add_option("--arch", o.arch, "of kernel and flight: arm64 is cross-built, amd64 is the build at hand")
      ->check(CLI::IsMember({"arm64", "amd64"}));
  app.add_option("--cycles", o.cycles, "control cycles of the quiet flight (0: as the form says)")
      ->check(CLI::Range(0, 10'000'000));
  app.add_option("--stress-cycles", o.stress_cycles, "control cycles under stress-ng (0: as the form says)")
      ->check(CLI::Range(0, 10'000'000));
  app.add_flag("--stress", o.stress, "as many cycles under stress-ng as in the quiet flight");
  auto* faults = app.add_flag("--faults", o.faults,
                              "instead: every kind of fault that a flight on replayed frames can show, on virtual time")
                     ->excludes(full);
  app.add_option("--only", o.only, "of those, the ones whose names this regular expression finds")
      ->needs(faults)
      ->check([](const std::string& text) { return text.find(' ') == text.npos ? "" : "no spaces, please"; });
  app.add_flag("--two-cores", o.two_cores, "instead: a core is taken away in flight; its times mean nothing")
      ->excludes(full);
  app.add_option("--json", o.json, "write all figures to this file");
  app.add_option("--patience", o.patience_s, "seconds of silence after which the guest counts as dead")
      ->check(CLI::Range(10.0, 86400.0));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

}  // namespace
}  // namespace wasp::tools::rt_guest

int main(int argc, char** argv) {
  using namespace wasp::tools::rt_guest;
  Options options;
  if (const auto code = parse(argc, argv, options)) return *code;
  try {
    return run(options);
  } catch (const Unavailable& e) {
    std::cerr << "wasp rt-guest: not available here: " << e.what() << "\n";
    return kUnavailable;
  } catch (const std::exception& e) {
    std::cerr << "wasp rt-guest: " << e.what() << "\n";
    return 1;
  }
}
