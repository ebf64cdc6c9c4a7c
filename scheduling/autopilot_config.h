// [autopilot] of the configuration: who is at the other end, over which line, and what wasp may ask of it.
#pragma once

#include <string>

#include "drivers/autopilot_checks.h"
#include "drivers/autopilot_link.h"
#include "scheduling/toml_table.h"

namespace wasp::scheduling {

struct AutopilotConfig {
  std::string endpoint = "serial:/dev/ttyUSB0:921600";
  drivers::Flavour flavour = drivers::Flavour::kWasp;
  int system_id = 1, component_id = 191;
  long follow_mode = -1;      ///< main mode in which it obeys; -1: the flavour's own
  bool arm = true;            ///< false: the pilot arms
  bool enter_mode = true;     ///< false: the pilot enters the mode
  bool enforce_check = true;  ///< false: parameters that are not as they must be are only said
  int thrust_field = 0;       ///< what it means: 0 as read from the autopilot, 1 climb rate, 2 thrust
  double hover_thrust = 0;    ///< 0 ... 1; 0: read back, then learned in flight
  drivers::SigningSettings signing;
  double stream_hz = 0;       ///< attitude and IMU; 0: 100, or what a slow serial line carries

  [[nodiscard]] std::uint32_t mode() const {
    return follow_mode >= 0 ? static_cast<std::uint32_t>(follow_mode) : drivers::facts_of(flavour).own_mode;
  }
  [[nodiscard]] drivers::LinkIdentity identity() const;
  /// What the check before arming is to hold the autopilot against.
  [[nodiscard]] drivers::SetupWish wish(float max_tilt_rad) const;
};

/// Takes the keys of [autopilot]; throws ConfigError.
void read_autopilot(TomlTable t, AutopilotConfig& config);

}  // namespace wasp::scheduling
