// What wasp's own HEARTBEAT says of it, so that everybody on the wire (autopilot, ground station, fault campaign) knows
// without asking: `system_status` is STANDBY while disarmed, ACTIVE while behaviours command, CRITICAL in hold and
// failsafe, EMERGENCY from the guardian; `custom_mode` carries flight mode, reason and sender. Sent once a second, and
// at once, in the same write as the setpoint, when any of it changes.
#pragma once

#include <cstdint>

#include "messages/mavlink_messages.h"
#include "rt/contract.h"
#include "types/messages.h"

namespace wasp::drivers {

struct CompanionState {
  FlightMode mode = FlightMode::kDisarmed;
  ModeReason reason = ModeReason::kNone;
  bool guardian = false;         ///< the guardian speaks in place of the flying process
  std::uint8_t incarnation = 0;  ///< flying processes started on this line before this one

  friend constexpr bool operator==(const CompanionState&, const CompanionState&) noexcept = default;
};

/// HEARTBEAT.custom_mode: bits 0-7 mode, 8-15 reason, 16 guardian, 24-31 incarnation.
constexpr std::uint32_t custom_mode_of(const CompanionState& s) WASP_REALTIME {
  return static_cast<std::uint32_t>(s.mode) | static_cast<std::uint32_t>(s.reason) << 8 | (s.guardian ? 1u << 16 : 0u) |
         static_cast<std::uint32_t>(s.incarnation) << 24;
}
constexpr CompanionState companion_state_of(std::uint32_t custom_mode) WASP_REALTIME {
  return {static_cast<FlightMode>(custom_mode & 0xff), static_cast<ModeReason>(custom_mode >> 8 & 0xff),
          (custom_mode >> 16 & 1) != 0, static_cast<std::uint8_t>(custom_mode >> 24)};
}
/// HEARTBEAT.system_status, a MAV_STATE.
constexpr std::uint8_t system_status_of(const CompanionState& s) WASP_REALTIME {
  if (s.guardian) return mavlink::mav_state::kEmergency;
  switch (s.mode) {
    case FlightMode::kDisarmed:
      return mavlink::mav_state::kStandby;
    case FlightMode::kHold:
    case FlightMode::kFailsafe:
      return mavlink::mav_state::kCritical;
    case FlightMode::kBehaviour:
    case FlightMode::kManual:
      break;
  }
  return mavlink::mav_state::kActive;
}

}  // namespace wasp::drivers
