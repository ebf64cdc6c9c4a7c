// wasp-record: writes a flight to disk as an observer. It maps the regions read-only and polls: whatever happens to it,
// the flight goes on undisturbed.
#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>

#include "shm/bus_guard.h"
#include "tools/record_session.h"

namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free);

/// Below every thread of the flight, even if the program that started us was real-time.
void step_back() {
  const sched_param none{};
  sched_setscheduler(0, SCHED_OTHER, &none);
  setpriority(PRIO_PROCESS, 0, 5);
}

void report_losses(const wasp::tools::RecordSession& session) {
  for (const auto& [key, c] : session.counts())
    if (c.lost + c.rejected > 0)
      fmt::print(stderr, "wasp-record: {}: {} lost, {} rejected of {}\n", key, c.lost, c.rejected,
                 c.taken + c.lost + c.rejected);
  if (const auto refused = session.refused_lines(); refused > 0)
    fmt::print(stderr, "wasp-record: the disk refused {} lines; the files hold whole lines only\n", refused);
}

}  // namespace

int main(int argc, char** argv) {
  wasp::tools::RecordOptions options;
  double poll_ms = 2.0;
  CLI::App app{
      "Records a flight from shared memory, read-only. Ends on SIGTERM, SIGINT, or when the flight has finished."};
  app.name("wasp-record");
  app.add_option("--instance", options.instance, "Instance to follow: the X of wasp.X.flight")->required();
  app.add_option("--out", options.directory, "Folder for log/ and recording/")->required();
  app.add_flag("--frames", options.frames, "Also keep the images: recording/ in TUM RGB-D layout");
  app.add_flag("--overwrite", options.overwrite, "Replace a recording that is already in the folder");
  app.add_option("--camera-toml", options.camera_toml, "Camera description to copy into recording/")
      ->check(CLI::ExistingFile);
  app.add_option("--poll-ms", poll_ms, "Time between looks [ms]")->check(CLI::Range(0.5, 100.0))->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  options.poll_period_ns = static_cast<wasp::DurationNs>(poll_ms * 1e6);

  std::signal(SIGTERM, [](int) { stop_requested = true; });
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on file sizes is a full disk, not an end
  std::signal(SIGINT, [](int) { stop_requested = true; });
  wasp::shm::install_bus_guard();
  step_back();
  try {
    wasp::tools::RecordSession session(options);
    session.finish(session.run(stop_requested));
    report_losses(session);
  } catch (const std::exception& error) {
    fmt::print(stderr, "wasp-record: {}\n", error.what());
    return 1;
  }
  return 0;
}
