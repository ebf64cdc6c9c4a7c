#include "scheduling/config.h"

#include <fmt/format.h>

#include <numbers>
#include <span>
#include <sstream>
#include <utility>

#include "scheduling/default_config.h"
#include "scheduling/toml_durations.h"

namespace wasp::scheduling {
namespace {

/// `value` as one of `names`, which are in the order of the enumeration.
template <class Enum>
void read_choice(TomlTable& t, const char* key, Enum& value, const std::vector<std::string>& names) {
  std::string name = names[static_cast<std::size_t>(value)];
  t.text_value(key, name, names);
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == name) value = static_cast<Enum>(i);
}

void read_thread(TomlTable& t, ThreadRow& row) {
  t.number("core", row.core, -1, 1023);
  t.number("priority", row.priority, 1, 99);
  read_microseconds(t, "budget_us", row.budget_ns);
}

void read_run(TomlTable t, Config& c) {
  t.flag("enforce_real_time", c.enforce_real_time);
  t.flag("strict_syscalls", c.strict_syscalls);
  t.number("heap_mib", c.heap_mib, 1, 4096);
  read_choice(t, "admission", c.admission, {"enforce", "warn", "off"});
  read_microseconds(t, "blocking_us", c.blocking_ns);
  t.number("demote_after", c.demote_after, 0, 1'000'000);
  t.number("incidents", c.incidents, 0, 1000);
  t.text_value("incident_dir", c.incident_dir);
  t.flag("trace_switches", c.trace_switches);
  t.text_value("tracefs", c.tracefs);
  t.finish();
}

void read_vector(TomlTable& t, const char* key, std::span<float> out, double low, double high) {
  std::vector<double> numbers;
  t.numbers(key, numbers, low, high);
  if (!numbers.empty() && numbers.size() != out.size()) t.refuse(fmt::format("'{}' needs {} numbers", key, out.size()));
  for (std::size_t i = 0; i < numbers.size(); ++i) out[i] = static_cast<float>(numbers[i]);
}

/// Lens and mount of either camera. Angles are degrees in the file only.
void read_geometry(TomlTable& t, CameraGeometry& camera, double& pitch_down_deg) {
  Intrinsics& k = camera.intrinsics;
  t.number("width_px", k.width_px, 16, 8192);
  t.number("height_px", k.height_px, 16, 8192);
  t.number("fx_px", k.fx_px, 1, 1e5);
  t.number("fy_px", k.fy_px, 1, 1e5);
  t.number("cx_px", k.cx_px, -1e4, 1e5);
  t.number("cy_px", k.cy_px, -1e4, 1e5);
  for (const auto& [key, value] : {std::pair{"k1", &k.k1}, {"k2", &k.k2}, {"p1", &k.p1}, {"p2", &k.p2}, {"k3", &k.k3}})
    t.number(key, *value, -10, 10);
  read_choice(t, "lens", camera.lens_kind, {"pinhole", "fisheye"});
  read_vector(t, "fisheye_k", camera.fisheye_k, -10, 10);
  t.number("pitch_down_deg", pitch_down_deg, -90, 90);
  camera.R_body_cam = R_body_cam_from_pitch_down(to_radians(Degrees{pitch_down_deg}));
  read_vector(t, "position_body_m", {camera.position_body_m.data(), 3}, -10, 10);
}

/// What only real cameras have.
void read_camera_settings(TomlTable& t, drivers::CameraSettings& s) {
  t.text_value("device", s.device);
  t.text_value("pixel_format", s.pixel_format);
  t.number("exposure_us", s.exposure_us, 0, 1e6);
  t.number("gain", s.gain, -1, 1e6);
  t.text_value("trigger", s.trigger, {"off", "external"});
  t.number("buffers", s.buffers, 2, 32);
  t.number("readout_us", s.readout_us, -1, 1e6);
}

void read_camera(TomlTable t, Config& c) {
  t.text_value("driver", c.camera_driver, {"sim", "replay", "v4l2", "dc1394", "kinect"});
  read_camera_settings(t, c.camera_settings);
  t.number("rate_hz", c.camera_rate_hz, 1, 1000);
  t.number("stuck_frames", c.stuck_frames, 0, 1000);
  read_geometry(t, c.camera, c.camera_pitch_down_deg);
  t.finish();
}

void read_camera_down(TomlTable t, DownCameraConfig& c) {
  t.flag("enabled", c.enabled);
  t.text_value("driver", c.driver, {"sim", "v4l2", "dc1394", "kinect"});
  read_camera_settings(t, c.settings);
  t.number("rate_hz", c.rate_hz, 1, 1000);
  read_geometry(t, c.geometry, c.pitch_down_deg);
  t.finish();
}

/// A number for each leg; angles are degrees in the file only.
struct LegColumn {
  const char* key;
  double low, high;
  void (*set)(control::HoverLeg&, float);
  std::vector<double> values = {};
};

float radians(float degrees) { return degrees * std::numbers::pi_v<float> / 180.f; }

std::vector<LegColumn> read_leg_columns(TomlTable& t) {
  using Leg = control::HoverLeg;
  std::vector<LegColumn> columns{
      {"forward_mps", -3, 5, [](Leg& l, float v) { l.forward_mps = v; }},
      {"yaw_amplitude_degps", 0, 180, [](Leg& l, float v) { l.yaw_amplitude_radps = radians(v); }},
      {"yaw_period_s", 0.5, 1000, [](Leg& l, float v) { l.yaw_period_s = v; }},
      {"tilt_amplitude_deg", 0, 30, [](Leg& l, float v) { l.tilt_amplitude_rad = radians(v); }},
      {"tilt_period_s", 0.5, 1000, [](Leg& l, float v) { l.tilt_period_s = v; }},
      {"bob_amplitude_m", 0, 5, [](Leg& l, float v) { l.bob_amplitude_m = v; }},
      {"bob_period_s", 0.5, 1000, [](Leg& l, float v) { l.bob_period_s = v; }},
      {"behaviours_climb", 0, 1, [](Leg& l, float v) { l.behaviours_climb = v != 0; }},
  };
  for (LegColumn& c : columns) t.numbers(c.key, c.values, c.low, c.high);
  return columns;
}

void read_mission(TomlTable t, Config& c) {
  control::MissionParams& m = c.control.mission;
  std::vector<double> heights, seconds;
  t.numbers("heights_m", heights, 0.3, 20.0);
  t.numbers("seconds", seconds, 1, 36'000);
  t.number("patience_s", c.patience_s, 0, 3600);
  t.number("landed_margin_m", m.landed_margin_m, 0.01, 1);
  const auto legs = read_leg_columns(t);
  t.finish();
  if (heights.empty() && seconds.empty()) return;
  if (heights.size() != seconds.size() || heights.size() > control::MissionParams::kMaxLegs)
    t.refuse("mission.heights_m and mission.seconds must have the same length, 1 to 8");
  m.leg_count = static_cast<int>(heights.size());
  for (std::size_t i = 0; i < heights.size(); ++i)
    m.legs[i].height_m = static_cast<float>(heights[i]), m.legs[i].seconds = static_cast<float>(seconds[i]);
  for (const LegColumn& leg : legs) {
    if (leg.values.empty()) continue;
    if (leg.values.size() != heights.size())
      t.refuse(std::string("mission.") + leg.key + " must have as many values as mission.heights_m");
    for (std::size_t i = 0; i < leg.values.size(); ++i) leg.set(m.legs[i], static_cast<float>(leg.values[i]));
  }
}

void read_velocity(TomlTable& t, control::ControlParams& p) {
  auto& hold = p.velocity_hold;
  read_choice(t, "velocity_hold", hold.hold, {"off", "sideways", "both"});
  t.number("velocity_kp_1ps", hold.kp_1ps, 0, 10);
  t.number("velocity_ki_1ps2", hold.ki_1ps2, 0, 10);
  t.number("velocity_max_accel_mps2", hold.max_accel_mps2, 0.1, 5);
  t.number("velocity_ramp_mps2", hold.ramp_mps2, 0.05, 10);
  t.number("avoid_hold_s", p.avoid_hold_s, 0, 36'000);
  double brake_deg = to_degrees(Radians{static_cast<double>(p.avoid_brake_rad)}).value;
  t.number("avoid_brake_deg", brake_deg, 0, 15);
  p.avoid_brake_rad = static_cast<float>(to_radians(Degrees{brake_deg}).value);
  t.flag("hold_heading", p.hold_heading);
  t.flag("barometer", p.barometer.enabled);
  t.number("standing_height_m", p.barometer.standing_height_m, 0, 5);
  t.number("min_height_m", p.min_height_m, 0.05, 100);
  t.number("max_height_m", p.max_height_m, 0.1, 120);
  if (p.min_height_m >= p.max_height_m) t.refuse("control.min_height_m must be below control.max_height_m");
}

void read_control(TomlTable t, Config& c) {
  double rate_hz = static_cast<double>(kSecond) / static_cast<double>(c.control_period_ns);
  t.number("rate_hz", rate_hz, 5, 200);
  c.control_period_ns = static_cast<DurationNs>(static_cast<double>(kSecond) / rate_hz);
  read_microseconds(t, "deadline_us", c.control_deadline_ns);
  read_milliseconds(t, "attitude_age_limit_ms", c.control.attitude_age_limit_ns);
  read_milliseconds(t, "link_age_limit_ms", c.control.link_age_limit_ns);
  read_milliseconds(t, "ground_hold_limit_ms", c.control.ground_hold_limit_ns);
  read_choice(t, "failsafe_action", c.failsafe, {"flavour", "descend", "stop_stream"});
  t.number("failsafe_thrust_share", c.control.failsafe_thrust_share, 0.5, 1.0);
  t.number("failsafe_sink_mps", c.control.failsafe_sink_mps, 0.05, 2);
  read_velocity(t, c.control);
  auto& hold = c.control.altitude_hold;
  t.number("mass_kg", hold.mass_kg, 0.05, 50);
  t.number("full_thrust_n", hold.full_thrust_n, 0.5, 2000);
  t.number("kp_npm", hold.kp_npm, 0, 1000);
  t.number("ki_npms", hold.ki_npms, 0, 1000);
  t.number("kd_nspm", hold.kd_nspm, 0, 1000);
  t.number("max_climb_mps", hold.max_climb_mps, 0.05, 5);
  t.number("climb_kp_1ps", hold.climb_kp_1ps, 0, 10);
  t.number("climb_ki_1ps2", hold.climb_ki_1ps2, 0, 10);
  t.number("max_correction_n", hold.max_correction_n, 0.1, 1000);
  double tilt_deg = to_degrees(Radians{static_cast<double>(c.control.limits.max_tilt_rad)}).value;
  t.number("max_tilt_deg", tilt_deg, 1, 45);
  c.control.limits.max_tilt_rad = static_cast<float>(to_radians(Degrees{tilt_deg}).value);
  t.finish();
  if (hold.mass_kg * 9.81f > 0.95f * hold.full_thrust_n) t.refuse("the vehicle is too heavy for its thrust");
}

void read_behaviours(TomlTable t, Config& c, bool foreign_behaviours) {
  for (std::size_t i = 0; i < c.behaviours.size(); ++i) {
    TomlTable b = t.table(c.behaviours[i].name.c_str());
    control::ArbiterRow& row = c.control.arbiter.rows[i];
    b.flag("enabled", c.behaviours[i].enabled);
    read_thread(b, c.behaviours[i]);
    read_choice(b, "frames", c.behaviours[i].frames_in_order, {"newest", "in_order"});
    read_milliseconds(b, "age_limit_ms", row.age_limit_ns);
    b.number("height_rank", row.height_rank, -1, 23);
    b.number("velocity_rank", row.velocity_rank, -1, 23);
    b.number("climb_rank", row.climb_rank, -1, 23);
    b.number("heading_weight", row.heading_weight, 0, 100);
    b.number("pitch_weight", row.pitch_weight, 0, 100);
    c.behaviour_params[i].merge(b.table("params"));
    b.finish();
  }
  if (!foreign_behaviours) t.finish();
}

void read_threads(TomlTable threads, Config& c) {
  for (ThreadRow* row : {&c.control_thread, &c.link_thread, &c.camera_thread}) {
    TomlTable t = threads.table(row->name.c_str());
    read_thread(t, *row);
    if (row == &c.link_thread)
      read_microseconds(t, "period_us", c.link_period_ns);  // woken by bytes: it has no releases to overrun
    else
      read_choice(t, "overrun", row->overrun, {"skip", "catch_up", "stop"});
    t.finish();
  }
  threads.finish();
}

/// What follows from the flavour where nothing else is said. Other autopilots take their time: an estimator that
/// settles, a satellite receiver that finds its place.
void settle(Config& c) {
  constexpr float kPatience_s = 20, kPatienceWithOthers_s = 120;
  const bool own = c.autopilot.flavour == drivers::Flavour::kWasp;
  control::MissionParams& m = c.control.mission;
  m.patience_s = c.patience_s > 0 ? c.patience_s : own ? kPatience_s : kPatienceWithOthers_s;
  m.pilot_arms = !c.autopilot.arm;
  m.pilot_enters = !c.autopilot.enter_mode;
  const bool descends = c.failsafe == FailsafeChoice::kByFlavour ? own : c.failsafe == FailsafeChoice::kDescend;
  c.control.failsafe_action = descends ? control::FailsafeAction::kDescend : control::FailsafeAction::kStopStream;
}

/// `foreign_behaviours`: sections of behaviours this program does not have are passed over.
void read_document(TomlTable root, Config& c, bool foreign_behaviours) {
  read_run(root.table("run"), c);
  read_autopilot(root.table("autopilot"), c.autopilot);
  read_camera(root.table("camera"), c);
  read_camera_down(root.table("camera_down"), c.camera_down);
  read_mission(root.table("mission"), c);
  read_control(root.table("control"), c);
  read_threads(root.table("threads"), c);
  read_telemetry(root.table("telemetry"), c.telemetry);
  read_guardian(root.table("guardian"), c.guardian);
  read_behaviours(root.table("behaviour"), c, foreign_behaviours);
  root.finish();
  settle(c);
}

}  // namespace

bool is_device(const std::string& camera_driver) { return camera_driver != "sim" && camera_driver != "replay"; }

Config load_config(const std::vector<std::string>& paths, const std::vector<std::string>& behaviour_names) {
  Config config;
  if (behaviour_names.size() > control::kMaxBehaviours) throw ConfigError("too many behaviours");
  for (const auto& name : behaviour_names) {
    config.behaviours.push_back({name, 1, 50, 4 * kMillisecond});
    config.behaviours.back().enabled = false;
  }
  config.behaviour_params.assign(behaviour_names.size(), TomlTable(toml::table{}));
  config.control.arbiter.behaviour_count = static_cast<int>(behaviour_names.size());
  std::istringstream defaults(kDefaultConfig);
  read_document(TomlTable::parse(defaults, "built-in config/wasp.toml"), config, true);
  for (const auto& path : paths) override_config(TomlTable::parse_file(path), config);
  return config;
}

void override_config(TomlTable document, Config& config) { read_document(std::move(document), config, false); }

}  // namespace wasp::scheduling
