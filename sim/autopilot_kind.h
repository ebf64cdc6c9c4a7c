// How PX4 and ArduCopter differ, as far as a companion computer meets it: modes on the wire, what a setpoint means and
// how long it lasts, who is let in. After their sources, which docs/autopilots.md names.
#pragma once

#include <cstdint>

#include "drivers/autopilot_flavour.h"
#include "types/time.h"

namespace wasp::sim {

using drivers::Flavour;

/// What follows when the setpoints end in the mode that obeys them.
enum class OnSilence : std::uint8_t {
  kDescend,  ///< wasp: levels and descends, still in the mode; a new setpoint takes over again
  kLand,     ///< PX4: leaves the mode for an automatic landing
  kLevel     ///< ArduCopter: levels, holds the height, stays in the mode
};

struct AutopilotKind {
  Flavour flavour = Flavour::kWasp;
  std::uint8_t mav_autopilot = 0;
  OnSilence on_silence = OnSilence::kDescend;
  bool climb_rate = false;        ///< the thrust field is one
  bool needs_stream = false;      ///< before the mode
  bool hears_in_mode = false;     ///< setpoints outside the mode are dropped
  DurationNs idle_disarm_ns = 0;  ///< armed and not off the ground for so long: disarmed; 0: never
};

constexpr AutopilotKind kind_of(Flavour flavour) noexcept {
  switch (flavour) {
    case Flavour::kPx4:
      return {flavour, 12, OnSilence::kLand, false, true, false, 10 * kSecond};
    case Flavour::kArduPilot:
      return {flavour, 3, OnSilence::kLevel, true, false, true, 10 * kSecond};
    case Flavour::kWasp:
      break;
  }
  return {};
}

}  // namespace wasp::sim
