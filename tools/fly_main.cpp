// `wasp fly`: starts the simulator, the recorder and the flight process, shows progress, judges the flight from its
// logs and writes the report. It maps the flight's memory read-only and never speaks to the autopilot.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "drivers/recording.h"
#include "rt/clock.h"
#include "rt/process.h"
#include "scheduling/config.h"
#include "scheduling/replay_camera.h"
#include "shm/topics.h"
#include "tools/child_process.h"
#include "tools/flight_results.h"
#include "tools/fly_monitor.h"
#include "tools/fly_options.h"
#include "tools/latency_table.h"
#include "tools/program_paths.h"

namespace wasp::tools {
namespace {

namespace fs = std::filesystem;

std::atomic<int> interrupts{0};
void on_interrupt(int) { interrupts.fetch_add(1); }

constexpr double kOverhead_s = 8.0;  // arming, landing, start-up: for the progress bar only

/// One run: its folder, its instance name in shared memory, its plan.
struct Run {
  FlyOptions options;
  fs::path folder;
  std::string instance;
  bool real_time = false;
  std::string note;  ///< why it is not real time
  double flight_seconds = 80;
  bool recorded_attitude = false;
  std::string exit_reason;
};

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

/// Behaviour sections are read by the flight process; here only [mission] matters.
std::vector<control::HoverLeg> configured_legs(const FlyOptions& o) {
  std::vector<control::HoverLeg> legs;
  std::vector<double> heights{0.5, 1.0}, seconds{40, 40};
  std::vector<std::string> files{(config_folder() / "wasp.toml").string()};
  if (!o.config.empty()) files.push_back(o.config);
  for (const auto& f : files) {
    auto mission = scheduling::TomlTable::parse_file(f).table("mission");
    mission.numbers("heights_m", heights, 0.3, 4.0);
    mission.numbers("seconds", seconds, 1, 36'000);
  }
  if (heights.size() != seconds.size() || heights.empty())
    throw scheduling::ConfigError("mission.heights_m and mission.seconds must have the same length");
  double total = 0;
  for (const double s : seconds) total += s;
  const double scale = o.seconds > 0 ? o.seconds / total : 1.0;
  for (std::size_t i = 0; i < heights.size(); ++i)
    legs.push_back({static_cast<float>(heights[i]), static_cast<float>(std::max(1.0, seconds[i] * scale))});
  return legs;
}

/// The part of the configuration that this run decides: endpoint, camera, mission.
void write_override(Run& run) {
  std::string text = "# written by wasp fly for this run\n[run]\n";
  text += fmt::format("enforce_real_time = {}\nstrict_syscalls = {}\n", run.real_time, run.options.strict_syscalls);
  text += fmt::format("[autopilot]\nendpoint = \"serial:{}:921600\"\n", fs::absolute(run.folder / "tty").string());
  if (run.options.replay.empty()) {
    std::string heights, seconds;
    run.flight_seconds = 0;
    for (const auto& leg : configured_legs(run.options)) {
      heights += fmt::format("{}{}", heights.empty() ? "" : ", ", leg.height_m);
      seconds += fmt::format("{}{:.3f}", seconds.empty() ? "" : ", ", leg.seconds);
      run.flight_seconds += static_cast<double>(leg.seconds);
    }
    text += fmt::format("[mission]\nheights_m = [{}]\nseconds = [{}]\n", heights, seconds);
  } else {
    text += "[camera]\ndriver = \"replay\"\n";
  }
  write_text(run.folder / "override.toml", text);
}

/// Asks the flight binary itself, for the rights may have been granted to it alone.
void check_rights(Run& run) {
  if (run.options.no_rt) {
    run.note = "real time was not asked for (--no-rt)";
    return;
  }
  const fs::path answer = run.folder / "log/rights.txt";
  ChildProcess asked({program("wasp"), "flight", "--check-rights"}, answer.string());
  while (!asked.poll()) rt::sleep_until(rt::now() + 5 * kMillisecond);
  run.real_time = asked.poll() == 0;
  if (run.real_time) return;
  std::ifstream file(answer);
  for (std::string line; std::getline(file, line);) {
    if (run.options.enforce) throw std::runtime_error(line);
    std::cerr << "warning: " << line << "\n";
    run.note += (run.note.empty() ? "" : "; ") + line;
  }
  std::cerr << "warning: this flight is NOT REAL TIME; every figure is marked so\n";
}

std::vector<std::string> flight_arguments(const Run& run) {
  std::vector<std::string> a{program("wasp"), "flight",   "--instance",
                             run.instance,    "--config", (config_folder() / "wasp.toml").string()};
  if (!run.options.config.empty()) a.insert(a.end(), {"--config", run.options.config});
  a.insert(a.end(), {"--config", (run.folder / "override.toml").string()});
  if (!run.real_time) a.push_back("--no-rt");
  if (!run.options.replay.empty())
    a.insert(a.end(), {"--replay", run.options.replay, "--seconds", fmt::format("{}", run.options.seconds)});
  return a;
}

std::vector<std::string> sim_arguments(const Run& run) {
  std::vector<std::string> a{program("wasp-sim"),
                             "--instance",
                             run.instance,
                             "--tty-link",
                             (run.folder / "tty").string(),
                             "--seed",
                             std::to_string(run.options.seed)};
  if (!run.options.replay.empty()) a.push_back("--no-camera");
  if (!run.options.safety_pilot) a.push_back("--no-safety-pilot");
  return a;
}

std::vector<std::string> recorder_arguments(const Run& run) {
  std::vector<std::string> a{program("wasp-record"), "--instance", run.instance, "--out", run.folder.string()};
  if (run.options.record) a.insert(a.end(), {"--frames", "--camera-toml", (run.folder / "camera.toml").string()});
  return a;
}

/// Waits, with generous patience, until the simulator's serial line is there.
void wait_for_line(const Run& run, ChildProcess& sim) {
  const TimeNs deadline = rt::now() + 60 * kSecond;
  while (!fs::exists(run.folder / "tty")) {
    if (const auto code = sim.poll())
      throw std::runtime_error(fmt::format("the simulator ended with code {} at start; see {}", *code,
                                           (run.folder / "log/sim.txt").string()));
    if (rt::now() > deadline || interrupts > 1) throw std::runtime_error("the simulator did not come up");
    rt::sleep_until(rt::now() + 10 * kMillisecond);
  }
}

/// Shows progress until the flight process has ended; passes interrupts on. Returns its exit code.
int watch(const Run& run, ChildProcess& flight, ChildProcess& sim) {
  FlyMonitor monitor(run.instance);
  const bool terminal = isatty(STDOUT_FILENO) != 0 && !run.options.json;
  const TimeNs start = rt::now();
  int passed_on = 0;
  double printed_s = -10;
  while (!flight.poll()) {
    if (interrupts > passed_on) {
      passed_on = interrupts;
      std::cerr << (passed_on == 1 ? "\ninterrupted: landing in order (once more: stop at once)\n"
                                   : "\nstopping at once\n");
      flight.signal(passed_on == 1 ? SIGINT : SIGKILL);
    }
    if (const auto code = sim.poll()) {
      std::cerr << fmt::format("\nthe simulator ended with code {}\n", *code);
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
  ChildProcess sim(sim_arguments(run), (run.folder / "log/sim.txt").string());
  wait_for_line(run, sim);
  ChildProcess recorder(recorder_arguments(run), (run.folder / "log/recorder.txt").string());
  {
    ChildProcess flight(flight_arguments(run), (run.folder / "log/flight.txt").string());
    flight_code = watch(run, flight, sim);
  }
  recorder.end(SIGTERM, 60.0);
  sim.end(SIGTERM, 10.0);
  for (const auto& region :
       {shm::flight_region(run.instance), shm::camera_region(run.instance), shm::truth_region(run.instance)})
    shm::Region::remove(region);
  fs::remove(run.folder / "tty");
}

std::string scheduler_text(const Run& run) {
  return run.real_time ? "SCHED_FIFO, locked memory" : "SCHED_OTHER (not real time)";
}

/// Share of control ticks that may miss: none where kernel and rights promise real time, 5 % where one of them does not
/// (a simulation on a shared machine).
double allowed_share(const Run& run) { return run.real_time && rt::kernel_is_preempt_rt() ? 0.0 : 0.05; }

nlohmann::json run_document(const Run& run, const std::vector<Phase>& phases, const std::vector<Result>& results) {
  nlohmann::json doc{{"name", run.options.name},
                     {"mission", run.options.replay.empty() ? run.options.mission : "replay"},
                     {"seconds", run.flight_seconds},
                     {"kernel", rt::kernel_description()},
                     {"host", rt::host_description()},
                     {"scheduler", scheduler_text(run)},
                     {"real_time", run.real_time},
                     {"mode_note", run.note},
                     {"seed", run.options.seed},
                     {"exit_reason", run.exit_reason},
                     {"camera", run.options.replay.empty() ? "simulated Kinect" : "recording " + run.options.replay}};
  char stamp[40];
  const std::time_t now = std::time(nullptr);
  std::strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S%z", std::localtime(&now));
  doc["started"] = stamp;
  for (const auto& p : phases)
    doc["phases"].push_back(
        {{"name", p.name}, {"setpoint_m", p.setpoint_m}, {"start_ns", p.start_ns}, {"end_ns", p.end_ns}});
  for (const auto& r : results) doc["results"].push_back(to_json(r));
  return doc;
}

std::vector<Result> judge(const Run& run, int flight_code, const std::vector<Phase>& phases,
                          const RunSummary& summary) {
  std::vector<Result> results;
  results.push_back({"flight process exit code", static_cast<double>(flight_code), "", "== 0", flight_code == 0});
  results.push_back(
      {"mission flown to its end", summary.mission_result == 1 ? 1.0 : 0.0, "", "== 1", summary.mission_result == 1});
  if (run.options.replay.empty())
    for (auto& r : hover_results(run.folder / "log", phases)) results.push_back(std::move(r));
  for (auto& r : timing_results(summary, allowed_share(run))) results.push_back(std::move(r));
  return results;
}

int conclude(Run& run, int flight_code) {
  std::vector<StageSummary> stages;
  RunSummary summary;
  if (std::ifstream file(run.folder / "log/stages.json"); file) {
    const auto doc = nlohmann::json::parse(file, nullptr, false);
    if (!doc.is_discarded()) {
      stages = stages_from_json(doc);
      summary = run_from_json(doc);
    }
  }
  run.exit_reason = interrupts > 0     ? "interrupted by the user, landed in order"
                    : flight_code == 0 ? "mission ended in order"
                                       : fmt::format("flight process ended with code {}", flight_code);
  const auto phases = read_phases(run.folder / "log");
  const auto results = judge(run, flight_code, phases, summary);
  write_text(run.folder / "run.json", run_document(run, phases, results).dump(1) + "\n");
  ChildProcess report({program("wasp-report"), run.folder.string()}, (run.folder / "log/report.txt").string());
  const TimeNs deadline = rt::now() + 120 * kSecond;
  while (!report.poll() && rt::now() < deadline) rt::sleep_until(rt::now() + 10 * kMillisecond);

  bool ok = true;
  if (!run.options.json)
    std::cout << latency_table(
        stages, rt::kernel_description() + ", " + scheduler_text(run) + ", " + rt::host_description(), run.real_time);
  for (const auto& r : results) {
    ok = ok && r.ok;
    if (run.options.json) {
      auto line = to_json(r);
      line["real_time"] = run.real_time;
      std::cout << line.dump() << "\n";
    } else {
      std::cout << fmt::format("{:<4} {:<48} {:>10.4g} {:<2} {}\n",
                               r.bar.empty() ? ""
                               : r.ok        ? "ok"
                                             : "MISS",
                               r.name, r.value, r.unit, r.bar.empty() ? "" : "bar " + r.bar);
    }
  }
  if (flight_code != 0)
    if (std::ifstream log(run.folder / "log/flight.txt"); log) std::cerr << log.rdbuf();
  if (!run.options.json)
    std::cout << (ok ? "mission succeeded" : "MISSION FAILED") << "; report: " << (run.folder / "report.html").string()
              << "\n";
  return ok ? 0 : 1;
}

/// `--replay example`: a short recording made by our own simulator.
std::string example_recording(const FlyOptions& o) {
  const fs::path folder = o.out / "example";
  if (!fs::exists(folder / "recording/depth.txt")) {
    std::cout << "making the example recording with the simulator: " << folder.string() << "\n" << std::flush;
    ChildProcess fly(
        {program("wasp"), "fly", "--name", "example", "--out", o.out.string(), "--seconds", "6", "--record"},
        (o.out / "example.txt").string());
    while (!fly.poll()) rt::sleep_until(rt::now() + 100 * kMillisecond);
    if (!fs::exists(folder / "recording/depth.txt"))
      throw std::runtime_error("the example recording could not be made; see " + (o.out / "example.txt").string());
  }
  return (folder / "recording").string();
}

void plan_replay(Run& run) {
  const auto recording = drivers::Recording::open(run.options.replay);
  run.flight_seconds =
      run.options.seconds > 0 ? run.options.seconds : to_seconds(scheduling::ReplayCamera::lap_ns(recording));
  std::cout << fmt::format("replaying {} ({} frames, {:.1f} s, {} layout) for {:.1f} s\n", run.options.replay,
                           recording.entries().size(), to_seconds(scheduling::ReplayCamera::lap_ns(recording)),
                           recording.layout(), run.flight_seconds);
}

void write_camera_toml(const Run& run) {
  scheduling::Config c;
  write_text(
      run.folder / "camera.toml",
      fmt::format("width_px = {}\nheight_px = {}\nfx_px = {}\nfy_px = {}\ncx_px = {}\ncy_px = {}\npitch_down_deg = {}\n"
                  "depth_units_per_m = 1000\nposition_body_m = [0.05, 0.0, 0.0]\n",
                  c.camera.intrinsics.width_px, c.camera.intrinsics.height_px, c.camera.intrinsics.fx_px,
                  c.camera.intrinsics.fy_px, c.camera.intrinsics.cx_px, c.camera.intrinsics.cy_px,
                  c.camera_pitch_down_deg));
}

int fly(FlyOptions options) {
  Run run;
  fs::create_directories(options.out);
  if (options.replay == "example") options.replay = example_recording(options);
  run.options = std::move(options);
  run.folder = run.options.out / run.options.name;
  run.instance = run.options.name;
  if (fs::exists(run.folder / "run.json") || fs::exists(run.folder / "log/imu.csv"))
    throw std::runtime_error(run.folder.string() +
                             " holds an earlier run; choose another --name (nothing is overwritten)");
  if (!run.options.replay.empty()) plan_replay(run);
  fs::create_directories(run.folder / "log");
  check_rights(run);
  write_override(run);
  write_camera_toml(run);
  int flight_code = 1;
  fly_processes(run, flight_code);
  return conclude(run, flight_code);
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
  try {
    return wasp::tools::fly(std::move(options));
  } catch (const std::exception& e) {
    std::cerr << "wasp fly: " << e.what() << "\n";
    return 1;
  }
}
