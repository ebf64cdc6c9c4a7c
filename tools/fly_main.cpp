// `wasp fly`: starts the simulator or the real camera, the recorder and the flight process, shows progress, judges the flight from its
// logs and writes the report. It maps the flight's memory read-only and never speaks to the autopilot.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <iostream>

#include "rt/clock.h"
#include "shm/topics.h"
#include "tools/child_process.h"
#include "tools/fly_monitor.h"
#include "tools/fly_run.h"
#include "tools/fly_verdict.h"
#include "tools/fly_world.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;

std::atomic<int> interrupts{0};
void on_interrupt(int) { interrupts.fetch_add(1); }

constexpr double kOverhead_s = 8.0;  // arming, landing, start-up: for the progress bar only

/// Shows progress until the flight process has ended; passes interrupts on. Returns its exit code.
int watch(const Run& run, ChildProcess& flight, FlyWorld& world) {
  FlyMonitor monitor(run.instance);
  const bool terminal = isatty(STDOUT_FILENO) != 0 && !run.options.json;
  const TimeNs start = rt::now();
  int passed_on = 0;
  double printed_s = -10;
  while (!flight.poll()) {
    if (interrupts > passed_on) {
      ++passed_on;  // one step a look: the first is always "land"
      std::cerr << (passed_on == 1 ? "\ninterrupted: landing in order (once more: stop at once)\n"
                                   : "\nstopping at once\n");
      flight.signal(passed_on <= 2 ? SIGINT : SIGQUIT);  // the second stops it by its own way, the third kills it
    }
    if (!world.look_after()) {
      flight.end(SIGINT, 5.0);
      break;
    }
    const double elapsed_s = to_seconds(rt::now() - start);
    if (!run.options.json && (terminal || elapsed_s - printed_s >= 10)) {
      printed_s = elapsed_s;
      const std::string line = progress_line(monitor.look(), elapsed_s, run.flight_seconds + kOverhead_s);
      if (terminal)
        std::cout << "\r\033[K" << line << std::flush;
      else
        std::cout << line << "\n" << std::flush;
    }
    rt::sleep_until(rt::now() + 200 * kMillisecond);
  }
  if (terminal) std::cout << "\n";
  return flight.poll().value_or(1);
}

void fly_processes(Run& run, int& flight_code) {
  FlyWorld world(run);
  world.wait_until_there([] { return interrupts > 1; });
  ChildProcess recorder(recorder_arguments(run), (run.folder / "log/recorder.txt").string());
  {
    ChildProcess flight(flight_arguments(run), (run.folder / "log/flight.txt").string());
    flight_code = watch(run, flight, world);
  }
  recorder.end(SIGTERM, 60.0);
  world.end();
  for (const auto& region : {shm::flight_region(run.instance), shm::camera_region(run.instance),
                             shm::relay_region(run.instance), shm::truth_region(run.instance)})
    shm::Region::remove(region);
  fs::remove(run.folder / "tty");
}

int fly(FlyOptions options) {
  Run run = plan_run(std::move(options));
  check_rights(run);
  write_configuration(run);
  int flight_code = 1;
  fly_processes(run, flight_code);
  return conclude(run, flight_code, interrupts > 0);
}

}  // namespace
}  // namespace wasp::tools

int main(int argc, char** argv) {
  wasp::tools::FlyOptions options;
  if (const auto code = wasp::tools::parse_fly_options(argc, argv, options)) return *code;
  struct sigaction action {};
  action.sa_handler = wasp::tools::on_interrupt;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);
  try {
    return wasp::tools::fly(std::move(options));
  } catch (const std::exception& e) {
    std::cerr << "wasp fly: " << e.what() << "\n";
    return 1;
  }
}
