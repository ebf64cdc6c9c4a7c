// [telemetry] of the configuration: what is told on the autopilot's line besides setpoints, how often, and how much of
// the line that may take.
#pragma once

#include "drivers/autopilot_flavour.h"
#include "drivers/parameter_value.h"
#include "scheduling/toml_table.h"

namespace wasp::scheduling {

struct TelemetryConfig {
  double budget_Bps = 0;            ///< most bytes a second; 0: a quarter of what the line carries, sockets 20,000
  std::string parameters = "auto";  ///< encoding of parameter values; auto: as the autopilot's flavour has it
  bool texts = true;                ///< STATUSTEXT
  double computer_status_hz = 1, obstacle_distance_hz = 10, optical_flow_hz = 10, named_values_hz = 2;  ///< 0: not
  double cues_hz = 0, latencies_hz = 0, state_hz = 0, flow_field_hz = 0;  ///< wasp's own messages; behaviours in turn
  double obstacle_above_m = 0.4, obstacle_below_m = 0.4;  ///< of the camera: what stands between is in the way
  double position_hz = 0;  ///< of LOCAL_POSITION_NED, asked of the autopilot; 0: not asked for
  double obstacle_least_m = 0.3, obstacle_greatest_m = 4.0;
};

/// Takes the keys of [telemetry]; throws ConfigError.
void read_telemetry(TomlTable t, TelemetryConfig& config);

/// The encoding for an autopilot of this flavour.
drivers::ParameterEncoding encoding_for(const TelemetryConfig& config, drivers::Flavour flavour);

}  // namespace wasp::scheduling
