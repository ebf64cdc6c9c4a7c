#include "tools/fly_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <numeric>

#include "drivers/recording.h"
#include "rt/clock.h"
#include "scheduling/config.h"
#include "scheduling/fault_socket.h"
#include "scheduling/replay_camera.h"
#include "sim/sim_config.h"
#include "tools/camera_section.h"
#include "tools/child_process.h"
#include "tools/flight_config.h"
#include "tools/mission_files.h"
#include "tools/program_paths.h"

namespace wasp::tools {

namespace fs = std::filesystem;

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

namespace {

struct Legs {
  std::vector<double> heights_m, seconds;
};

/// The flight process' configuration before what this run decides: defaults, mission, user.
std::vector<std::string> configuration_files(const Run& run) {
  std::vector<std::string> files{(config_folder() / "wasp.toml").string(), (run.mission / "flight.toml").string()};
  if (!run.options.config.empty()) files.push_back(run.options.config);
  return files;
}

/// The legs as configured, scaled to --seconds. Everything else of a leg is read by the flight process alone.
Legs planned_legs(const Run& run) {
  Legs legs;
  for (const auto& file : configuration_files(run)) {
    auto mission = scheduling::TomlTable::parse_file(file).table("mission");
    mission.numbers("heights_m", legs.heights_m, 0.3, 20.0);
    mission.numbers("seconds", legs.seconds, 1, 36'000);
  }
  if (legs.heights_m.size() != legs.seconds.size() || legs.heights_m.empty())
    throw scheduling::ConfigError("mission.heights_m and mission.seconds must have the same length");
  const double total = std::accumulate(legs.seconds.begin(), legs.seconds.end(), 0.0);
  if (run.options.seconds > 0)
    for (double& s : legs.seconds) s = std::max(1.0, s * run.options.seconds / total);
  return legs;
}

/// [camera] driver, the last file that says it. A replay needs none.
std::string configured_camera(const Run& run) {
  std::string driver = "sim";
  if (!run.options.replay.empty()) return driver;
  for (const auto& file : configuration_files(run))
    scheduling::TomlTable::parse_file(file).table("camera").text_value("driver", driver);
  return driver;
}

/// What the simulator shows, told to the flight process: cameras are said once, in the mission's sim.toml.
std::string camera_sections(const sim::SimConfig& sim) {
  return fmt::format("[camera]\nrate_hz = {}\n{}", sim.camera_rate_hz, camera_keys(sim.camera)) +
         fmt::format("[camera_down]\nenabled = {}\nrate_hz = {}\n{}", sim.down.enabled, sim.down.rate_hz,
                     camera_keys(sim.down.setup.geometry));
}

/// The part of the configuration that this run decides: endpoint, cameras, length of the legs.
void write_override(Run& run, const sim::SimConfig& sim) {
  std::string text = "# written by wasp fly for this run\n[run]\n";
  text += fmt::format("enforce_real_time = {}\nstrict_syscalls = {}\n", run.real_time, run.options.strict_syscalls);
  text += fmt::format("incident_dir = \"{}\"\n", fs::absolute(run.folder / "incidents").string());
  if (!flies_configured_autopilot(run)) {
    const std::string line = run.options.udp_port > 0
                                 ? fmt::format("udp://127.0.0.1:{}", run.options.udp_port)
                                 : fmt::format("serial:{}:921600", fs::absolute(run.folder / "tty").string());
    text += fmt::format("[autopilot]\nendpoint = \"{}\"\n", line);
    if (!run.options.autopilot.empty()) text += fmt::format("flavour = \"{}\"\n", run.options.autopilot);
  }
  if (run.options.follow == "flight") text += "[telemetry]\nposition_hz = 50\n";
  if (run.options.replay.empty()) {
    const Legs legs = planned_legs(run);
    run.flight_seconds = std::accumulate(legs.seconds.begin(), legs.seconds.end(), 0.0);
    text += fmt::format("[mission]\nheights_m = [{}]\nseconds = [{:.3f}]\n", fmt::join(legs.heights_m, ", "),
                        fmt::join(legs.seconds, ", "));
    if (!on_hardware(run)) text += camera_sections(sim);
  } else {
    text += "[camera]\ndriver = \"replay\"\n";
  }
  write_text(run.folder / "override.toml", text);
}

/// `--replay example`: a short recording made by our own simulator.
std::string example_recording(const FlyOptions& o) {
  const fs::path folder = o.out / "example";
  if (!fs::exists(folder / "recording/depth.txt")) {
    std::cerr << "making the example recording with the simulator: " << folder.string() << "\n" << std::flush;
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
  (run.options.json ? std::cerr : std::cout) << fmt::format(
      "replaying {} ({} frames, {:.1f} s, {} layout) for {:.1f} s\n", run.options.replay, recording.entries().size(),
      to_seconds(scheduling::ReplayCamera::lap_ns(recording)), recording.layout(), run.flight_seconds);
}

}  // namespace

Run plan_run(FlyOptions options) {
  Run run;
  fs::create_directories(options.out);
  if (options.replay == "example") options.replay = example_recording(options);
  run.options = std::move(options);
  run.folder = run.options.out / run.options.name;
  run.mission = mission_folder(run.options.mission);
  run.instance = run.options.name;
  run.camera_driver = configured_camera(run);
  if (on_hardware(run) && (!run.options.world.empty() || follows(run)))
    throw std::runtime_error("--world and --follow are the simulator's, but [camera] driver = \"" + run.camera_driver +
                             "\" is a real camera");
  if (fs::exists(run.folder / "run.json") || fs::exists(run.folder / "log/imu.csv"))
    throw std::runtime_error(run.folder.string() +
                             " holds an earlier run; choose another --name (nothing is overwritten)");
  if (run.options.faults && fault_socket(run).string().size() > scheduling::FaultSocket::kLongestPath)
    throw std::runtime_error(fmt::format("the path of a socket has at most {} bytes, {} has {}: choose a shorter --out",
                                         scheduling::FaultSocket::kLongestPath, fault_socket(run).string(),
                                         fault_socket(run).string().size()));
  if (!run.options.replay.empty()) plan_replay(run);
  fs::create_directories(run.folder / "log");
  return run;
}

std::filesystem::path fault_socket(const Run& run) { return run.folder / "faults.sock"; }

void write_configuration(Run& run) {
  const auto sim = sim::load_sim_config((run.mission / "sim.toml").string());
  write_override(run, sim);
  const CameraGeometry camera = on_hardware(run) ? read_flight_config(configuration_files(run)).camera : sim.camera;
  write_text(run.folder / "camera.toml", camera_keys(camera) + "depth_units_per_m = 1000\n");
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
  std::vector<std::string> a{program("wasp-guard"), "--instance", run.instance};
  for (const auto& file : configuration_files(run)) a.insert(a.end(), {"--config", file});
  a.insert(a.end(), {"--config", (run.folder / "override.toml").string()});
  if (!run.real_time) a.push_back("--no-rt");
  if (!run.options.replay.empty())
    a.insert(a.end(), {"--replay", run.options.replay, "--seconds", fmt::format("{}", run.options.seconds)});
  if (run.options.faults) a.insert(a.end(), {"--fault-socket", fault_socket(run).string()});
  if (!run.options.fault_timeline.empty()) a.insert(a.end(), {"--faults", run.options.fault_timeline});
  return a;
}

bool follows(const Run& run) { return !run.options.follow.empty(); }

bool flies_configured_autopilot(const Run& run) { return on_hardware(run) || follows(run); }

std::vector<std::string> sim_arguments(const Run& run) {
  std::vector<std::string> a{program("wasp-sim"),
                             "--instance",
                             run.instance,
                             "--config",
                             (run.mission / "sim.toml").string(),
                             "--seed",
                             std::to_string(run.options.seed)};
  if (!run.options.world.empty()) a.insert(a.end(), {"--world", run.options.world});
  if (follows(run)) {  // the camera alone, led by the pose of the vehicle that another program flies
    a.insert(a.end(), {"--follow", run.options.follow});
    return a;
  }
  if (run.options.udp_port > 0)
    a.insert(a.end(), {"--udp", fmt::format("127.0.0.1:{}", run.options.udp_port)});
  else
    a.insert(a.end(), {"--tty-link", (run.folder / "tty").string()});
  const auto autopilot = scheduling::load_guard_plan(configuration_files(run)).autopilot;
  const std::string flavour(drivers::facts_of(autopilot.flavour).name);
  a.insert(a.end(), {"--autopilot", run.options.autopilot.empty() ? flavour : run.options.autopilot});
  if (!run.options.replay.empty()) a.push_back("--no-camera");
  if (!run.options.safety_pilot) a.push_back("--no-safety-pilot");
  const auto& signing = autopilot.signing;
  if (signing.mode != "off") a.insert(a.end(), {"--signing-key", signing.key_file});
  return a;
}

bool on_hardware(const Run& run) { return scheduling::is_device(run.camera_driver); }

/// Waits for a camera that is not there: it may be started again while the flight goes on.
std::vector<std::string> camera_arguments(const Run& run) {
  std::vector<std::string> a{program("wasp-camera"), "--instance", run.instance};
  for (const auto& file : configuration_files(run)) a.insert(a.end(), {"--config", file});
  a.insert(a.end(), {"--config", (run.folder / "override.toml").string()});
  if (!run.real_time) a.push_back("--no-rt");
  return a;
}

std::vector<std::string> recorder_arguments(const Run& run) {
  std::vector<std::string> a{program("wasp-record"), "--instance", run.instance, "--out", run.folder.string()};
  if (run.options.record) a.insert(a.end(), {"--frames", "--camera-toml", (run.folder / "camera.toml").string()});
  return a;
}

}  // namespace wasp::tools
