// How serious an event of the log is to a ground station (MAV_SEVERITY), by its first words.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "messages/mavlink_messages.h"

namespace wasp::scheduling {

/// nullopt: not told. What the autopilot itself said is not sent back to it.
inline std::optional<std::uint8_t> severity_of(std::string_view event) {
  using namespace mavlink;  // NOLINT: its enumerations
  struct Row {
    std::string_view head;
    std::optional<std::uint8_t> severity;
  };
  static constexpr std::array kRows{
      Row{"autopilot: ", std::nullopt},
      Row{"mission: ", mav_severity::kInfo},
      Row{"flight mode: behaviour", mav_severity::kInfo},
      Row{"flight mode: ", mav_severity::kNotice},
      Row{"failsafe because: ", mav_severity::kCritical},
      Row{"hold because: ", mav_severity::kWarning},
      Row{"manual because: ", mav_severity::kNotice},
      Row{"not arming: ", mav_severity::kWarning},
      Row{"mission ends early: ", mav_severity::kWarning},
      Row{"command refused: ", mav_severity::kWarning},
  };
  for (const Row& row : kRows)
    if (event.starts_with(row.head)) return row.severity;
  return mav_severity::kWarning;  // of the link and the camera: troubles
}

}  // namespace wasp::scheduling
