// One run of `wasp fly`: its folder, its instance name in shared memory, its plan, and the command lines of its
// processes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/fly_options.h"

namespace wasp::tools {

struct Run {
  FlyOptions options;
  std::filesystem::path folder;
  std::filesystem::path mission;  ///< folder with its sim.toml and flight.toml
  std::string instance;
  std::string camera_driver = "sim";  ///< as configured; a device: real hardware, no simulator
  bool real_time = false;
  std::string note;  ///< why it is not real time
  double flight_seconds = 80;
  std::string exit_reason;
};

/// Names folder and instance, makes the example recording if asked for, opens a recording to learn its length. Throws
/// std::runtime_error on what cannot be flown; nothing of an earlier run is overwritten.
Run plan_run(FlyOptions options);

/// Asks the flight binary itself which rights it lacks, for they may have been granted to it alone. Warns; throws where
/// real time is demanded.
void check_rights(Run& run);

/// Writes override.toml (endpoint, the simulator's cameras, length of the legs: what this run decides) and camera.toml
/// (for the recording).
void write_configuration(Run& run);

/// Where a flight with --faults listens.
std::filesystem::path fault_socket(const Run& run);

std::vector<std::string> flight_arguments(const Run& run);
std::vector<std::string> sim_arguments(const Run& run);
/// Of `wasp camera`, for real hardware.
std::vector<std::string> camera_arguments(const Run& run);
/// True where a real camera looks and the configured autopilot flies: nothing is simulated.
bool on_hardware(const Run& run);
/// True where the configured autopilot flies and only the camera is simulated.
bool follows(const Run& run);
/// Either: the autopilot is the one that the configuration names, and nobody knows the truth.
bool flies_configured_autopilot(const Run& run);
std::vector<std::string> recorder_arguments(const Run& run);

/// Throws std::runtime_error naming the path.
void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace wasp::tools
