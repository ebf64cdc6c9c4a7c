#include "faults/flight_plan.h"

#include <fmt/format.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "behaviours.h"
#include "rt/clock.h"
#include "scheduling/config.h"
#include "tools/child_process.h"
#include "tools/program_paths.h"

namespace wasp::faults {
namespace {

namespace fs = std::filesystem;

/// Both programs are told the same.
constexpr const char* kCamera =
    "[camera]\nrate_hz = 30.0\nwidth_px = 320\nheight_px = 240\nfx_px = 160.0\nfy_px = 160.0\ncx_px = 159.5\n"
    "cy_px = 119.5\npitch_down_deg = 30.0\n";

/// In the laboratory under the safety pilot's eyes; a cruise is down a corridor and by itself.
constexpr const char* kHoverWorld = "[world]\nkind = \"laboratory\"\n";
constexpr const char* kCruiseWorld =
    "[run]\nsafety_pilot = false\n[world]\nkind = \"corridor\"\n[wind]\ngust_mps = 0.2\n";

constexpr const char* kCruise =
    "[control]\nvelocity_hold = \"both\"\n[behaviour.flow_field]\nenabled = true\n[behaviour.odometry]\nenabled = "
    "true\n"
    "[behaviour.flow_balance]\nenabled = true\n[behaviour.obstacle_depth]\nenabled = true\n"
    "[behaviour.edge_altitude]\nenabled = false\n";
constexpr const char* kHoverControl = "[behaviour.edge_altitude]\nenabled = false\n";

/// Climbs and descents slow enough for several faults.
constexpr const char* kSlowly = "[control]\nmax_climb_mps = 0.15\n";

/// Legs by phase.
const char* mission(Phase phase) {
  switch (phase) {
    case Phase::kIdle:
    case Phase::kHover:
      return "heights_m = [0.7]\nseconds = [3000.0]\n";
    case Phase::kTakeOff:
      return "heights_m = [2.5]\nseconds = [60.0]\n";
    case Phase::kCruise:
      return "heights_m = [1.0, 1.0]\nseconds = [4.0, 3000.0]\nforward_mps = [0.0, 0.3]\n";
    case Phase::kLanding:
      return "heights_m = [2.2]\nseconds = [15.0]\n";
  }
  return "";
}

void write(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

/// Exit code and all that a program printed.
std::pair<int, std::string> ask(const std::vector<std::string>& arguments) {
  const fs::path log = fs::temp_directory_path() / fmt::format("wasp-faults-{}.txt", getpid());
  int code = 1;
  try {
    tools::ChildProcess child(arguments, log.string());
    while (!child.poll()) rt::sleep_until(rt::now() + 5 * kMillisecond);
    code = *child.poll();
  } catch (const std::exception&) {
    code = 127;  // not there
  }
  std::ifstream file(log);
  std::stringstream text;
  text << file.rdbuf();
  fs::remove(log);
  return {code, text.str()};
}

std::string flight_text(const FlightPlan& plan) {
  const fs::path folder = fs::absolute(plan.folder);
  std::string text = fmt::format(
      "[run]\nenforce_real_time = false\nadmission = \"warn\"\nincident_dir = \"{}\"\n[autopilot]\n"
      "endpoint = \"serial:{}:921600\"\n",
      (folder / "incidents").string(), (folder / "tty").string());
  if (!plan.replay.empty()) return text + "[camera]\ndriver = \"replay\"\n" + kHoverControl;
  text += kCamera;
  text += std::string("[mission]\npatience_s = 600.0\n") + mission(plan.phase);
  if (plan.phase == Phase::kTakeOff || plan.phase == Phase::kLanding) text += kSlowly;
  return text + (plan.phase == Phase::kCruise ? kCruise : kHoverControl);
}

/// What vehicle and camera are both told: the same instance, world and seed.
std::vector<std::string> simulator_arguments(const FlightPlan& plan) {
  return {tools::program("wasp-sim"),
          "--instance",
          plan.instance,
          "--config",
          (plan.folder / "sim.toml").string(),
          "--seed",
          std::to_string(plan.seed)};
}

}  // namespace

const char* name_of(Phase phase) {
  constexpr std::array kNames = {"idle", "take-off", "hover", "cruise", "landing"};
  return kNames[static_cast<std::size_t>(phase)];
}

const char* name_of(Promise promise) {
  constexpr std::array kNames = {"neutral",   "unaffected", "within limits", "guardian", "reported",
                                 "line back", "ends",       "restarts",      "refused"};
  return kNames[static_cast<std::size_t>(promise)];
}

Abilities find_abilities() {
  Abilities a;
  const std::string wasp = tools::program("wasp");
  a.real_time = ask({wasp, "flight", "--check-rights"}).first == 0;
  a.fault_points = ask({wasp, "flight", "--help"}).second.find("--fault-socket") != std::string::npos;
  a.guardian = ask({wasp, "guard", "--help"}).first == 0;
#ifndef WASP_WITHOUT_RENDERER
  a.renderer = true;
  a.gateway = ask({tools::program("wasp-iceoryx"), "--help"}).first == 0;
#endif
  return a;
}

void write_configuration(const FlightPlan& plan) {
  fs::create_directories(plan.folder);
  write(plan.folder / "sim.toml", std::string(kCamera) + (plan.phase == Phase::kCruise ? kCruiseWorld : kHoverWorld));
  write(plan.folder / "flight.toml", flight_text(plan));
  if (!plan.weakened.empty()) write(plan.folder / "weakened.toml", plan.weakened);
}

WireLimits limits_of(const FlightPlan& plan) {
  const scheduling::Config config =
      scheduling::load_config({(plan.folder / "flight.toml").string()}, scheduling::names_of(all_behaviours()));
  WireLimits limits;
  limits.max_tilt_rad = config.control.limits.max_tilt_rad;
  limits.max_yaw_rate_radps = config.control.limits.max_yaw_rate_radps;
  limits.period_ns = config.control_period_ns;
  limits.longest_gap_ns = 3 * config.control_period_ns + config.control_deadline_ns;
  limits.cue_age_ns = 0;
  for (const auto& row : config.control.arbiter.rows) limits.cue_age_ns = std::max(limits.cue_age_ns, row.age_limit_ns);
  return limits;
}

std::string autopilot_line(const FlightPlan& plan) { return (plan.folder / "tty-autopilot").string(); }
std::string flight_line(const FlightPlan& plan) { return (plan.folder / "tty").string(); }
std::string fault_socket(const FlightPlan& plan) { return (plan.folder / "faults.sock").string(); }

std::vector<std::string> sim_arguments(const FlightPlan& plan) {
  auto a = simulator_arguments(plan);
  a.insert(a.end(), {"--tty-link", autopilot_line(plan), "--no-camera"});
  return a;
}

std::vector<std::string> camera_arguments(const FlightPlan& plan) {
  auto a = simulator_arguments(plan);
  a.push_back("--camera-only");
  return a;
}

std::vector<std::string> observer_arguments(const FlightPlan& plan, std::string_view observer) {
  if (observer == "monitor") return {tools::program("wasp-top"), "--instance", plan.instance, "--period-s", "0.05"};
  if (observer == "gateway")
    return {tools::program("wasp-iceoryx"), "export", "--instance", plan.instance, "--all", "--wait", "60"};
  return {tools::program("wasp-record"), "--instance", plan.instance};
}

std::vector<std::string> flight_arguments(const FlightPlan& plan) {
  const bool guarded = plan.guarded && plan.abilities.guardian;
  std::vector<std::string> a{tools::program("wasp"),
                             guarded ? "guard" : "flight",
                             "--instance",
                             plan.instance,
                             "--config",
                             (plan.folder / "flight.toml").string()};
  if (!plan.weakened.empty()) a.insert(a.end(), {"--config", (plan.folder / "weakened.toml").string()});
  if (!plan.abilities.real_time) a.push_back("--no-rt");
  if (plan.abilities.fault_points) a.insert(a.end(), {"--fault-socket", fault_socket(plan)});
  if (!plan.replay.empty()) a.insert(a.end(), {"--replay", plan.replay.string(), "--preload", "--seconds", "3000"});
  a.insert(a.end(), plan.flight_options.begin(), plan.flight_options.end());
  return a;
}

}  // namespace wasp::faults
