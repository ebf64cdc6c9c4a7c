// One row for each key: section, name, range, and where the number goes. Booleans and words are numbers here too.
#include "sim/sim_config.h"

#include <fstream>
#include <functional>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "drivers/toml_text.h"

namespace wasp::sim {
namespace {

/// What the file may set; angles are degrees in the file only.
struct Draft {
  SimConfig config;
  double pitch_down_deg = 30, down_pitch_down_deg = 90;
};

struct Row {
  const char* section;
  const char* key;
  double low, high;
  std::function<void(Draft&, double)> set;
  std::vector<std::string> words = {};  ///< names of 0, 1, ...; empty: the value is a number
};

template <class Number>
Row row(const char* section, const char* key, double low, double high, Number& (*where)(Draft&)) {
  return {section, key, low, high, [where](Draft& d, double value) { where(d) = static_cast<Number>(value); }};
}

/// Where one camera's settings go.
struct CameraDraft {
  CameraGeometry& geometry;
  OpticsParams& optics;
  double& rate_hz;
  double& pitch_down_deg;
};
using CameraOf = CameraDraft (*)(Draft&);

CameraDraft front_of(Draft& d) { return {d.config.camera, d.config.optics, d.config.camera_rate_hz, d.pitch_down_deg}; }
CameraDraft down_of(Draft& d) {
  DownCamera& down = d.config.down;
  return {down.setup.geometry, down.setup.optics, down.rate_hz, d.down_pitch_down_deg};
}

/// A row of one camera. `where` picks the number in it; `scale` turns the file's unit into ours.
template <class Number>
Row row(const char* section, CameraOf of, const char* key, double low, double high, Number& (*where)(CameraDraft&),
        double scale = 1) {
  return {section, key, low, high, [of, where, scale](Draft& d, double value) {
            CameraDraft camera = of(d);
            where(camera) = static_cast<Number>(value * scale);
          }};
}

void add_camera_rows(std::vector<Row>& rows, const char* s, CameraOf of) {
  using D = CameraDraft;
  constexpr double kDegree = std::numbers::pi / 180, kMillisecond_s = 1e-3;
  // clang-format off
  rows.insert(rows.end(), {
      row<double>(s, of, "rate_hz", 1, 120, [](D& d) -> double& { return d.rate_hz; }),
      row<int>(s, of, "width_px", 32, 1920, [](D& d) -> int& { return d.geometry.intrinsics.width_px; }),
      row<int>(s, of, "height_px", 32, 1440, [](D& d) -> int& { return d.geometry.intrinsics.height_px; }),
      row<float>(s, of, "fx_px", 10, 10000, [](D& d) -> float& { return d.geometry.intrinsics.fx_px; }),
      row<float>(s, of, "fy_px", 10, 10000, [](D& d) -> float& { return d.geometry.intrinsics.fy_px; }),
      row<float>(s, of, "cx_px", -1000, 10000, [](D& d) -> float& { return d.geometry.intrinsics.cx_px; }),
      row<float>(s, of, "cy_px", -1000, 10000, [](D& d) -> float& { return d.geometry.intrinsics.cy_px; }),
      row<float>(s, of, "k1", -1, 1, [](D& d) -> float& { return d.geometry.intrinsics.k1; }),
      row<float>(s, of, "k2", -1, 1, [](D& d) -> float& { return d.geometry.intrinsics.k2; }),
      row<float>(s, of, "k3", -1, 1, [](D& d) -> float& { return d.geometry.intrinsics.k3; }),
      row<float>(s, of, "p1", -0.1, 0.1, [](D& d) -> float& { return d.geometry.intrinsics.p1; }),
      row<float>(s, of, "p2", -0.1, 0.1, [](D& d) -> float& { return d.geometry.intrinsics.p2; }),
      row<LensKind>(s, of, "lens", 0, 1, [](D& d) -> LensKind& { return d.geometry.lens_kind; }),
      row<float>(s, of, "fisheye_k1", -1, 1, [](D& d) -> float& { return d.geometry.fisheye_k[0]; }),
      row<float>(s, of, "fisheye_k2", -1, 1, [](D& d) -> float& { return d.geometry.fisheye_k[1]; }),
      row<float>(s, of, "fisheye_k3", -1, 1, [](D& d) -> float& { return d.geometry.fisheye_k[2]; }),
      row<float>(s, of, "fisheye_k4", -1, 1, [](D& d) -> float& { return d.geometry.fisheye_k[3]; }),
      row<float>(s, of, "field_of_view_deg", 10, 220, [](D& d) -> float& { return d.optics.field_of_view_rad; }, kDegree),
      row<bool>(s, of, "antialias", 0, 1, [](D& d) -> bool& { return d.optics.antialias; }),
      row<float>(s, of, "focus_m", 0.05, 1000, [](D& d) -> float& { return d.optics.focus_m; }),
      row<float>(s, of, "aperture_m", 0, 0.05, [](D& d) -> float& { return d.optics.aperture_m; }),
      row<float>(s, of, "exposure_ms", 0, 100, [](D& d) -> float& { return d.optics.exposure_s; }, kMillisecond_s),
      row<double>(s, of, "pitch_down_deg", -30, 90, [](D& d) -> double& { return d.pitch_down_deg; }),
      row<float>(s, of, "forward_m", -0.5, 0.5, [](D& d) -> float& { return d.geometry.position_body_m.x(); }),
      row<float>(s, of, "right_m", -0.5, 0.5, [](D& d) -> float& { return d.geometry.position_body_m.y(); }),
      row<float>(s, of, "below_m", -0.5, 0.15, [](D& d) -> float& { return d.geometry.position_body_m.z(); }),
  });
  // clang-format on
  for (Row& r : rows)
    if (std::string_view(r.key) == "lens") r.words = {"pinhole", "fisheye"};
}

/// A key whose value is one of `words`; `take` gets its place among them.
Row word_row(const char* section, const char* key, std::vector<std::string> words, void (*take)(Draft&, std::size_t)) {
  const auto last = static_cast<double>(words.size() - 1);
  return {section,         key, 0, last, [take](Draft& d, double i) { take(d, static_cast<std::size_t>(i)); },
          std::move(words)};
}

/// The configuration of table A.4, with its camera's place.
void take_preset(Draft& d, std::size_t i) {
  const VehiclePreset& preset = kVehiclePresets[i];
  d.config.vehicle = preset.params();
  d.pitch_down_deg = preset.camera_pitch_down_deg;
  d.config.camera.position_body_m =
      Vec3(static_cast<float>(preset.camera_forward_m), 0, static_cast<float>(preset.camera_below_m));
}

void add_vehicle_rows(std::vector<Row>& rows) {
  using D = Draft;
  constexpr double kDegree = std::numbers::pi / 180;
  std::vector<std::string> presets;
  for (const VehiclePreset& p : kVehiclePresets) presets.emplace_back(p.name);
  // clang-format off
  rows.insert(rows.end(), {
      word_row("vehicle", "preset", presets, &take_preset),
      row<double>("vehicle", "mass_kg", 0.5, 2.2, [](D& d) -> double& { return d.config.vehicle.mass_kg; }),
      row<double>("vehicle", "drag_Npmps", 0, 5, [](D& d) -> double& { return d.config.vehicle.drag_Npmps; }),
      row<double>("pilot", "cruise_mps", 0, 5, [](D& d) -> double& { return d.config.pilot.cruise_mps; }),
      row<double>("pilot", "cruise_distance_m", 0, 1e4, [](D& d) -> double& { return d.config.pilot.cruise_distance_m; }),
      row<bool>("pilot", "hold_heading", 0, 1, [](D& d) -> bool& { return d.config.pilot.hold_heading; }),
      row<double>("wind", "mean_mps", 0, 20, [](D& d) -> double& { return d.config.wind.mean_mps; }),
      {"wind", "mean_direction_deg", -360, 360, [](D& d, double v) { d.config.wind.from_rad = v * kDegree; }},
      row<double>("wind", "gust_mps", 0, 10, [](D& d) -> double& { return d.config.wind.gust_mps; }),
      row<double>("wind", "gust_time_s", 0.05, 600, [](D& d) -> double& { return d.config.wind.gust_time_s; }),
      row<bool>("stand", "turntable", 0, 1, [](D& d) -> bool& { return d.config.stand.turntable; }),
      row<double>("stand", "height_m", 0.05, 20, [](D& d) -> double& { return d.config.stand.height_m; }),
      {"stand", "amplitude_degps", 0, 360, [](D& d, double v) { d.config.stand.amplitude_radps = v * kDegree; }},
      row<double>("stand", "period_s", 0.5, 600, [](D& d) -> double& { return d.config.stand.period_s; }),
      row<double>("stand", "start_s", 0, 600, [](D& d) -> double& { return d.config.stand.start_s; }),
      word_row("stand", "profile", {"sine", "steps"},
               [](D& d, std::size_t i) { d.config.stand.profile = static_cast<StandProfile>(i); }),
  });
  // clang-format on
}

void add_world_rows(std::vector<Row>& rows) {
  using D = Draft;
  std::vector<std::string> kinds;
  for (const SceneKind& k : scene_kinds()) kinds.emplace_back(k.name);
  // clang-format off
  rows.insert(rows.end(), {
      word_row("world", "kind", kinds, [](D& d, std::size_t i) { d.config.world_kind = scene_kinds()[i].name; }),
      row<double>("world", "floor_edges_per_m", 0.05, 20,
          [](D& d) -> double& { return d.config.world.floor_edges_per_m; }),
      row<int>("world", "cartons", 0, 40, [](D& d) -> int& { return d.config.world.cartons; }),
      row<double>("world", "ground_edges_per_m", 0.02, 20,
          [](D& d) -> double& { return d.config.world.ground_edges_per_m; }),
      row<double>("world", "city_mean_low_m", 0.05, 50, [](D& d) -> double& { return d.config.world.city.mean_low_m; }),
      row<double>("world", "city_mean_high_m", 0.05, 50, [](D& d) -> double& { return d.config.world.city.mean_high_m; }),
      row<double>("world", "city_tallest_m", 0.3, 100, [](D& d) -> double& { return d.config.world.city.tallest_m; }),
      row<double>("world", "arena_step_at_s", 0, 600, [](D& d) -> double& { return d.config.world.arena_step_at_s; }),
  });
  // clang-format on
}

std::vector<Row> make_rows() {
  using D = Draft;
  // clang-format off
  std::vector<Row> rows{
      row<std::uint32_t>("run", "seed", 0, 4294967295.0, [](D& d) -> std::uint32_t& { return d.config.seed; }),
      row<bool>("run", "safety_pilot", 0, 1, [](D& d) -> bool& { return d.config.safety_pilot; }),
      word_row("autopilot", "flavour", {"wasp", "px4", "ardupilot"},
               [](D& d, std::size_t i) { d.config.flavour = static_cast<drivers::Flavour>(i); }),
      row<double>("run", "clock_offset_s", 0, 1e6, [](D& d) -> double& { return d.config.clock_offset_s; }),
      row<double>("imu", "gyro_noise_radps", 0, 1, [](D& d) -> double& { return d.config.imu.gyro_noise_radps; }),
      row<double>("imu", "gyro_bias_radps", 0, 1, [](D& d) -> double& { return d.config.imu.gyro_bias_radps; }),
      row<double>("imu", "gyro_walk_radps_sqrts", 0, 0.1,
          [](D& d) -> double& { return d.config.imu.gyro_walk_radps_sqrts; }),
      row<double>("imu", "accel_noise_mps2", 0, 10, [](D& d) -> double& { return d.config.imu.accel_noise_mps2; }),
      row<double>("imu", "accel_bias_mps2", 0, 2, [](D& d) -> double& { return d.config.imu.accel_bias_mps2; }),
      row<double>("imu", "accel_walk_mps2_sqrts", 0, 1,
          [](D& d) -> double& { return d.config.imu.accel_walk_mps2_sqrts; }),
      row<double>("imu", "mag_noise_gauss", 0, 1, [](D& d) -> double& { return d.config.imu.mag_noise_gauss; }),
      row<double>("imu", "pressure_noise_hpa", 0, 5, [](D& d) -> double& { return d.config.imu.pressure_noise_hpa; }),
      row<bool>("camera_down", "enabled", 0, 1, [](D& d) -> bool& { return d.config.down.enabled; }),
      row<bool>("sensor", "noise", 0, 1, [](D& d) -> bool& { return d.config.sensor.noise; }),
      row<float>("sensor", "depth_noise_steps", 0, 20,
          [](D& d) -> float& { return d.config.sensor.depth_noise_steps; }),
      row<float>("sensor", "min_range_m", 0.05, 5, [](D& d) -> float& { return d.config.sensor.min_range_m; }),
      row<float>("sensor", "max_range_m", 0.5, 10, [](D& d) -> float& { return d.config.sensor.max_range_m; }),
      row<float>("sensor", "dropout", 0, 1, [](D& d) -> float& { return d.config.sensor.dropout; }),
      row<float>("sensor", "gain", 0.01, 20, [](D& d) -> float& { return d.config.sensor.gain; }),
      row<float>("sensor", "read_noise", 0, 100, [](D& d) -> float& { return d.config.sensor.read_noise; }),
      row<float>("sensor", "photon_noise", 0, 10, [](D& d) -> float& { return d.config.sensor.photon_noise; }),
  };
  // clang-format on
  add_vehicle_rows(rows);
  add_world_rows(rows);
  add_camera_rows(rows, "camera", front_of);
  add_camera_rows(rows, "camera_down", down_of);
  return rows;
}

const std::vector<Row>& rows() {
  static const std::vector<Row> kRows = make_rows();
  return kRows;
}

[[noreturn]] void fail(const std::string& name, const std::string& why) { throw std::runtime_error(name + ": " + why); }
[[noreturn]] void fail(const std::string& name, const toml::value& value, const std::string& why) {
  fail(name + ":" + std::to_string(value.location().line()), why);
}

double number_of(const toml::value& value, const std::string& name, const std::string& key) {
  if (value.is_boolean()) return value.as_boolean() ? 1 : 0;
  if (value.is_integer()) return static_cast<double>(value.as_integer());
  if (value.is_floating()) return value.as_floating();
  fail(name, value, "'" + key + "' is neither a number nor true or false");
}

/// Position of a text among the row's words.
double word_of(const toml::value& value, const Row& row, const std::string& name, const std::string& key) {
  const std::string word = value.is_string() ? value.as_string().str : "";
  std::string allowed;
  for (std::size_t i = 0; i < row.words.size(); ++i) {
    if (row.words[i] == word) return static_cast<double>(i);
    allowed += (i == 0 ? "\"" : ", \"") + row.words[i] + "\"";
  }
  fail(name, value, "'" + key + "' is none of " + allowed);
}

void apply(Draft& draft, const std::string& section, const std::string& key, const toml::value& value,
           const std::string& name) {
  const std::string full = section + "." + key;
  for (const Row& r : rows()) {
    if (r.section != section || r.key != key) continue;
    const double number = r.words.empty() ? number_of(value, name, full) : word_of(value, r, name, full);
    if (!(number >= r.low && number <= r.high)) {
      std::ostringstream why;
      why << "'" << full << "' is " << number << ", allowed are " << r.low << " ... " << r.high;
      fail(name, value, why.str());
    }
    return r.set(draft, number);
  }
  fail(name, value, "unknown key '" + full + "'");
}

/// Largest share of the field at which the fisheye's radius still grows, 0 ... 1.
float growing_share(const CameraSetup& setup) {
  const auto& k = setup.geometry.fisheye_k;
  constexpr int kSteps = 200;
  for (int i = 1; i <= kSteps; ++i) {
    const float theta = 0.5f * setup.optics.field_of_view_rad * static_cast<float>(i) / kSteps, t2 = theta * theta;
    const float slope = 1.f + t2 * (3.f * k[0] + t2 * (5.f * k[1] + t2 * (7.f * k[2] + t2 * 9.f * k[3])));
    if (!(slope > 0.05f)) return static_cast<float>(i - 1) / kSteps;
  }
  return 1;
}

void check_camera(const CameraSetup& setup, const std::string& section, const std::string& name) {
  const Intrinsics& k = setup.geometry.intrinsics;
  if (k.width_px % 4 != 0 || k.height_px % 4 != 0)
    fail(name, section + ".width_px and " + section + ".height_px must be multiples of 4");
  if (setup.geometry.lens_kind == LensKind::kFisheye && growing_share(setup) < 1)
    fail(name, section + ".fisheye_k1 ... fisheye_k4 fold the image back within " + section + ".field_of_view_deg");
}

void check(const SimConfig& config, const std::string& name) {
  check_camera(config.front(), "camera", name);
  check_camera(config.down.setup, "camera_down", name);
  if (config.sensor.min_range_m >= config.sensor.max_range_m)
    fail(name, "sensor.min_range_m must be below sensor.max_range_m");
}

}  // namespace

SimConfig::SimConfig() {
  camera.R_body_cam = R_body_cam_from_pitch_down(to_radians(Degrees{30}));
  camera.position_body_m = Vec3(0.05f, 0, 0);
  CameraGeometry& below = down.setup.geometry;
  below.intrinsics = {
      .width_px = 320, .height_px = 240, .fx_px = 80.f, .fy_px = 80.f, .cx_px = 159.5f, .cy_px = 119.5f};
  below.lens_kind = LensKind::kFisheye;
  below.R_body_cam = R_body_cam_from_pitch_down(to_radians(Degrees{90}));
  below.position_body_m = Vec3(0, 0, 0.05f);
  down.setup.optics.field_of_view_rad = static_cast<float>(to_radians(Degrees{170}).value);
}

Scene generated_scene(const SimConfig& config) {
  SceneOptions options = config.world;
  options.seed = config.seed;
  return make_scene(config.world_kind, options);
}

SimConfig parse_sim_config(const std::string& toml_text, const std::string& name) {
  std::istringstream stream(toml_text);
  const toml::value document = drivers::parse_toml(stream, name);
  Draft draft;
  for (const bool preset : {true, false})  // it sets what other keys then change
    for (const auto& [section, table] : document.as_table()) {
      if (!table.is_table()) fail(name, table, "unknown key '" + section + "' outside any section");
      for (const auto& [key, value] : table.as_table())
        if ((section == "vehicle" && key == "preset") == preset) apply(draft, section, key, value, name);
    }
  draft.config.camera.R_body_cam = R_body_cam_from_pitch_down(to_radians(Degrees{draft.pitch_down_deg}));
  draft.config.down.setup.geometry.R_body_cam =
      R_body_cam_from_pitch_down(to_radians(Degrees{draft.down_pitch_down_deg}));
  check(draft.config, name);
  return draft.config;
}

SimConfig load_sim_config(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot open simulator configuration '" + path + "'");
  std::ostringstream text;
  text << file.rdbuf();
  return parse_sim_config(text.str(), path);
}

std::vector<std::string> sim_config_keys() {
  std::vector<std::string> keys;
  for (const Row& r : rows()) keys.push_back(std::string(r.section) + "." + r.key);
  return keys;
}

}  // namespace wasp::sim
