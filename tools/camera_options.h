// The command line of `wasp camera`.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scheduling/config.h"

namespace wasp::tools {

struct CameraOptions {
  std::string instance = "wasp";
  std::vector<std::string> configs;
  std::optional<std::string> driver, device, pixel_format;
  std::optional<int> width_px, height_px;
  std::optional<double> rate_hz, exposure_us, gain;
  bool list = false, stats = false, json = false, no_rt = false;
  bool wait = false;           ///< for a camera that is not there at the start
  std::filesystem::path save;  ///< empty: no pictures
  int frames = 5;
  double seconds = 0;  ///< 0: until a signal
};

/// Parses; on --help or an error prints what is due and returns the exit code instead.
std::optional<int> parse_camera_options(int argc, char** argv, CameraOptions& options);

/// The configuration the flight has, with what the command line says over it. Throws ConfigError.
scheduling::Config camera_config(const CameraOptions& options);

}  // namespace wasp::tools
