// Whose autopilot is at the other end, and what differs between them before anything is read: MAV_AUTOPILOT, the mode
// in which it obeys, where HEARTBEAT says the mode, how it writes parameters, what it needs before the mode. Sources:
// docs/autopilots.md.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "drivers/parameter_value.h"
#include "rt/contract.h"
#include "types/time.h"

namespace wasp::drivers {

enum class Flavour : std::uint8_t { kWasp = 0, kPx4 = 1, kArduPilot = 2 };

struct FlavourFacts {
  std::string_view name;                                   ///< as in the configuration
  std::uint32_t own_mode = 0;                              ///< main mode number in which it obeys by default
  ParameterEncoding encoding = ParameterEncoding::kCCast;  ///< where its capabilities do not say
  DurationNs stream_first_ns = 0;                          ///< setpoints must have come for so long before the mode
  bool asks_in_turn = false;                               ///< the mode first; armed only once it follows
};

inline constexpr std::array kFlavours{
    FlavourFacts{"wasp", 1, ParameterEncoding::kCCast, 0, false},
    FlavourFacts{"px4", 6, ParameterEncoding::kBytewise, 1500 * kMillisecond, true},  // PX4_CUSTOM_MAIN_MODE_OFFBOARD
    FlavourFacts{"ardupilot", 20, ParameterEncoding::kCCast, 0, true},                // Mode::Number::GUIDED_NOGPS
};

constexpr const FlavourFacts& facts_of(Flavour flavour) WASP_REALTIME {
  return kFlavours[static_cast<std::size_t>(flavour)];
}

/// HEARTBEAT.custom_mode to the number that DO_SET_MODE takes. PX4: main mode in bits 16-23.
constexpr std::uint32_t main_mode_of(Flavour flavour, std::uint32_t custom_mode) WASP_REALTIME {
  return flavour == Flavour::kPx4 ? custom_mode >> 16 & 0xff : custom_mode;
}

/// MAV_AUTOPILOT of a HEARTBEAT fits the flavour. wasp's own simulator says "generic", and anything may speak its
/// dialect.
constexpr bool fits(Flavour flavour, std::uint8_t mav_autopilot) WASP_REALTIME {
  constexpr std::uint8_t kArduPilotMega = 3, kPx4Autopilot = 12;
  if (flavour == Flavour::kPx4) return mav_autopilot == kPx4Autopilot;
  if (flavour == Flavour::kArduPilot) return mav_autopilot == kArduPilotMega;
  return true;
}

}  // namespace wasp::drivers
