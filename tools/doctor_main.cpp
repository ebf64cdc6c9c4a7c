// `wasp doctor`: finds out by doing whether this machine can fly real time, and says which commands would change what.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "tools/doctor_checks.h"

namespace wasp::tools {
namespace {

struct Options {
  std::string config;
  int core = -1;
  double seconds = 5;
  bool json = false, script = false;
};

struct Step {
  const char* what;
  double seconds;  ///< about how long it takes
  std::vector<Check> (*run)(const DoctorPlan&);
};

template <Check (*kCheck)(const DoctorPlan&)>
std::vector<Check> one(const DoctorPlan& plan) {
  return {kCheck(plan)};
}

std::vector<Step> steps(double wakeup_seconds) {
  return {{"SCHED_FIFO", 0, one<check_fifo>},
          {"SCHED_DEADLINE", 0, one<check_deadline_policy>},
          {"locked memory", 0.2, one<check_locked_memory>},
          {"sleep hold", 0, one<check_idle_hold>},
          {"kernel preemption", 1, one<check_preemption>},
          {"wake-up latency", wakeup_seconds + 1, check_wakeups},
          {"real-time throttling", 1.2, one<check_throttling>},
          {"fair-server stall", 1.2, one<check_fair_server>},
          {"core isolation", 0, one<check_isolation>},
          {"interrupt affinity", 0, one<check_interrupts>},
          {"SMT siblings", 0, one<check_siblings>},
          {"frequency governor", 0, one<check_governor>},
          {"turbo", 0, one<check_turbo>},
          {"sleep states", 0, one<check_idle_states>},
          {"clock source", 0, one<check_clocksource>},
          {"virtual machine", 0, one<check_virtual_machine>},
          {"timer migration", 0, one<check_timer_migration>},
          {"lock-up watchdogs", 0, one<check_watchdog>},
          {"swap", 0, one<check_swap>},
          {"transparent huge pages", 0, one<check_huge_pages>},
          {"serial line", 0, one<check_tty>},
          {"USB autosuspend", 0, one<check_usb>}};
}

std::vector<Check> examine(const DoctorPlan& plan) {
  const auto all = steps(plan.seconds);
  const bool terminal = isatty(STDERR_FILENO) != 0;
  double left_s = 0;
  for (const auto& s : all) left_s += s.seconds;
  std::vector<Check> checks;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (terminal || all[i].seconds >= 1)
      std::cerr << fmt::format("{}[{:2}/{}] {} ... {:.0f} s left{}", terminal ? "\r\033[K" : "", i + 1, all.size(),
                               all[i].what, left_s, terminal ? "" : "\n")
                << std::flush;
    for (auto& c : all[i].run(plan)) checks.push_back(std::move(c));
    left_s -= all[i].seconds;
  }
  if (terminal) std::cerr << "\r\033[K";
  return checks;
}

std::optional<int> parse(int argc, char** argv, Options& o) {
  CLI::App app{
      "Finds out by doing whether this machine can fly real time: takes the rights, measures wake-ups, tries what the\n"
      "kernel takes away, reads what it says of itself, and prints the commands that would change it. It changes\n"
      "nothing that lasts. Exit code 0: all fine, 1: warnings or not everything could be found out, 2: cannot fly."};
  app.name("wasp doctor");
  app.option_defaults()->always_capture_default();
  app.add_option("--config", o.config, "TOML file whose keys override the defaults: cores, priorities, serial line")
      ->check(CLI::ExistingFile);
  app.add_option("--core", o.core, "examine for a flight on this core (-1: as configured)")
      ->check(CLI::Range(-1, 1023));
  app.add_option("--seconds", o.seconds, "length of the wake-up measurement")->check(CLI::Range(0.5, 3600.0));
  app.add_flag("--json", o.json, "print one JSON object");
  app.add_flag("--fix-script", o.script, "print a shell script of every command instead")->excludes("--json");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 3;
  }
  return std::nullopt;
}

int doctor(const Options& o) {
  const DoctorPlan plan = plan_doctor(o.config, o.core, o.seconds);
  if (o.core >= 0 && plan.core != o.core)
    throw std::runtime_error(
        fmt::format("--core {}: this process may run on {} only", o.core, core_text(plan.usable_cores)));
  const auto checks = examine(plan);
  std::cout << (o.json ? doctor_json(checks).dump(1) + "\n" : o.script ? fix_script(checks) : doctor_text(checks));
  return exit_code_of(checks);
}

}  // namespace
}  // namespace wasp::tools

int main(int argc, char** argv) {
  wasp::tools::Options options;
  if (const auto code = wasp::tools::parse(argc, argv, options)) return *code;
  try {
    return wasp::tools::doctor(options);
  } catch (const std::exception& e) {
    std::cerr << "wasp doctor: " << e.what() << "\n";
    return 3;
  }
}
