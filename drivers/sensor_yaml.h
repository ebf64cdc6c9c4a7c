// sensor.yaml of the EuRoC ASL layout: the few keys that matter here, each a scalar or a list in brackets, by hand. It
// is YAML of one fixed shape ("key: value", one nested T_BS), and a YAML library would be a dependency for forty lines.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>

#include "types/camera.h"

namespace wasp::drivers {

struct SensorYaml {
  std::optional<Eigen::Matrix4d> T_body_sensor;  ///< v_body = T v_sensor
  std::optional<double> rate_hz;
  std::optional<Lens> lens;  ///< of a camera
};

/// Throws std::runtime_error naming file and line for a value that is not what its key asks for, a rotation that is
/// none, or a camera or distortion model other than pinhole with radial-tangential (or radtan) or equidistant.
SensorYaml read_sensor_yaml(const std::filesystem::path& file);

}  // namespace wasp::drivers
