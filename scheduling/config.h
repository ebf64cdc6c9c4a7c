// The configuration of a flight process: what config/wasp.toml says, checked.
#pragma once

#include <string>
#include <vector>

#include "control/control_step.h"
#include "drivers/camera_driver.h"
#include "rt/periodic.h"
#include "rt/thread.h"
#include "scheduling/autopilot_config.h"
#include "scheduling/guard_config.h"
#include "scheduling/telemetry_config.h"
#include "scheduling/toml_table.h"
#include "types/camera.h"

namespace wasp::scheduling {

/// One row of the thread table.
struct ThreadRow {
  std::string name;
  int core = 1;
  int priority = 50;
  DurationNs budget_ns = 4 * kMillisecond;
  rt::OverrunPolicy overrun = rt::OverrunPolicy::kSkip;  ///< periodic threads: control, camera
  bool frames_in_order = false;                          ///< behaviours: every frame in turn, not the newest
  bool enabled = true;                                   ///< behaviours: false: no thread, no cue, not in the plan
  bool looks_down = false;                               ///< behaviours: released at the second camera's rate
};

/// The second camera, which looks down.
struct DownCameraConfig {
  bool enabled = false;  ///< false: behaviours that look down cannot be enabled
  std::string driver = "sim";
  drivers::CameraSettings settings;  ///< of a real camera
  double rate_hz = 30.0;
  double pitch_down_deg = 90.0;
  CameraGeometry geometry;
};

/// What happens without fresh evidence; by flavour: wasp descends, the stream to another autopilot stops.
enum class FailsafeChoice : std::uint8_t { kByFlavour, kDescend, kStopStream };

/// What the admission test does with a thread table that cannot keep its deadlines.
enum class AdmissionMode : std::uint8_t { kEnforce, kWarn, kOff };

struct Config {
  bool enforce_real_time = true;
  bool strict_syscalls = false;
  int heap_mib = 16;
  AdmissionMode admission = AdmissionMode::kEnforce;
  DurationNs blocking_ns = 200 * kMicrosecond;  ///< longest the kernel keeps a ready real-time thread waiting
  int demote_after = 10;                        ///< steps over budget in a row; 0: never
  int incidents = 8;                            ///< most incident files of one flight
  std::string incident_dir = "incidents";
  std::string tracefs;  ///< where tracefs is mounted; empty: the usual places
  bool trace_switches = true;

  AutopilotConfig autopilot;

  std::string camera_driver = "sim";
  drivers::CameraSettings camera_settings;  ///< of a real camera
  CameraGeometry camera;
  double camera_pitch_down_deg = 30.0;
  double camera_rate_hz = 30.0;  ///< what admission takes as the period of the behaviours
  int stuck_frames = 2;          ///< equal images in a row after which a camera counts as frozen; 0: not compared
  DownCameraConfig camera_down;

  DurationNs control_period_ns = 50 * kMillisecond;
  DurationNs control_deadline_ns = 10 * kMillisecond;
  control::ControlParams control;
  FailsafeChoice failsafe = FailsafeChoice::kByFlavour;  ///< control.failsafe_action follows from it
  float patience_s = 0;                                  ///< as configured; control.mission.patience_s follows from it

  TelemetryConfig telemetry;
  GuardConfig guardian;  ///< checked here, obeyed by `wasp guard`

  ThreadRow control_thread{"control", 1, 80, 2 * kMillisecond};
  ThreadRow link_thread{"link", 1, 70, 1 * kMillisecond};
  DurationNs link_period_ns = 5 * kMillisecond;  ///< least time between wake-ups that admission counts
  ThreadRow camera_thread{"camera", 1, 60, 5 * kMillisecond, rt::OverrunPolicy::kCatchUp};
  std::vector<ThreadRow> behaviours;        ///< index = Cue::behaviour
  std::vector<TomlTable> behaviour_params;  ///< [behaviour.NAME.params], checked by the behaviour's own list
};

/// True for a [camera] driver that is a device: `wasp camera` reads it.
bool is_device(const std::string& camera_driver);

/// The defaults, which are config/wasp.toml itself (built in), then `paths` in order; later ones override single keys.
/// `behaviour_names` are the behaviours this program has, in order; a section for any other is an error, and one
/// without `enabled = true` in any file is not enabled. Throws ConfigError naming file, line and value.
Config load_config(const std::vector<std::string>& paths, const std::vector<std::string>& behaviour_names);
/// One document more over what load_config returned. Throws ConfigError naming file, line and value.
void override_config(TomlTable document, Config& config);

}  // namespace wasp::scheduling
