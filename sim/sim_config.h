// Every setting of the simulator, with its default. config/sim.toml documents the same list; a key that is not in it,
// or a value outside its range, is an error that names the key.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/autopilot_flavour.h"
#include "sim/imu_model.h"
#include "sim/optics.h"
#include "sim/safety_pilot.h"
#include "sim/scene.h"
#include "sim/sensor_model.h"
#include "sim/stand.h"
#include "sim/wind.h"
#include "types/camera.h"

namespace wasp::sim {

/// A second camera, grey only. Its image's top points to the vehicle's front.
struct DownCamera {
  bool enabled = false;
  double rate_hz = 30;  ///< 1 ... 120
  CameraSetup setup;
};

struct SimConfig {
  std::uint32_t seed = 1;
  bool safety_pilot = true;
  PilotParams pilot;
  std::string signing_key_file;                        ///< not empty: signs, and obeys only what this key signed
  double clock_offset_s = 1000.25;                     ///< autopilot clock minus the simulator's, 0 ... 1e6
  drivers::Flavour flavour = drivers::Flavour::kWasp;  ///< whose autopilot it behaves as
  std::vector<std::string> autopilot_parameters;       ///< "NAME=VALUE", over those from the factory
  double camera_rate_hz = 30;                          ///< 1 ... 120
  CameraGeometry camera;                               ///< the front one
  OpticsParams optics;                                 ///< of the front camera
  DownCamera down;
  VehicleParams vehicle;
  WindParams wind;
  StandParams stand;
  ImuParams imu;
  SensorParams sensor;
  std::string world_kind = "laboratory";  ///< one of scene_kinds()
  SceneOptions world;                     ///< its seed is not used: `seed` above decides
  std::string world_file;                 ///< VRML97 to fly in instead; empty: the kind above

  /// The Kinect of the thesis: 640 x 480, f = 525 px, pitched down by 30 degrees, 5 cm ahead of the centre of mass; and
  /// a fisheye of 170 degrees, 320 x 240, below it that looks straight down (not enabled).
  SimConfig();

  [[nodiscard]] CameraSetup front() const { return {camera, optics}; }
};

/// The generated scene that the configuration asks for (world_file apart). Throws as make_scene does.
Scene generated_scene(const SimConfig& config);

/// Reads a TOML file over the defaults. Throws std::runtime_error naming the file and the key or line.
SimConfig load_sim_config(const std::string& path);
/// The same from text; `name` stands for the file in errors.
SimConfig parse_sim_config(const std::string& toml_text, const std::string& name);

/// All keys, as "section.key".
std::vector<std::string> sim_config_keys();

}  // namespace wasp::sim
