#include "tools/fly_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iostream>

#include "control/mission.h"
#include "drivers/recording.h"
#include "rt/clock.h"
#include "scheduling/config.h"
#include "scheduling/replay_camera.h"
#include "tools/child_process.h"
#include "tools/program_paths.h"

namespace wasp::tools {

namespace fs = std::filesystem;

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

namespace {

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
  text += fmt::format("incident_dir = \"{}\"\n", fs::absolute(run.folder / "incidents").string());
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

}  // namespace

Run plan_run(FlyOptions options) {
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
  return run;
}

void write_configuration(Run& run) {
  write_override(run);
  write_camera_toml(run);
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
  if (!run.options.world.empty()) a.insert(a.end(), {"--world", run.options.world});
  if (!run.options.replay.empty()) a.push_back("--no-camera");
  if (!run.options.safety_pilot) a.push_back("--no-safety-pilot");
  return a;
}

std::vector<std::string> recorder_arguments(const Run& run) {
  std::vector<std::string> a{program("wasp-record"), "--instance", run.instance, "--out", run.folder.string()};
  if (run.options.record) a.insert(a.end(), {"--frames", "--camera-toml", (run.folder / "camera.toml").string()});
  return a;
}

}  // namespace wasp::tools
