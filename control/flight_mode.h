// The flight mode has the last word. One table, read from the top each tick: the first row whose condition holds
// decides. Every loss has a named response: see kRows in the source and docs/flight_modes.md.
#pragma once

#include "types/messages.h"
#include "types/realtime.h"

namespace wasp::control {

/// What is true at this tick.
struct Situation {
  bool autopilot_armed = false;
  bool autopilot_follows = false;  ///< it is in the mode in which it obeys setpoints
  bool link_alive = false;         ///< heard from within the link age limit
  bool attitude_fresh = false;
  bool ground_seen = false;       ///< a height source is usable
  bool images_fresh = false;      ///< frames come, be they of use or not
  bool ground_lost_long = false;  ///< none was for longer than the hold limit
  bool setpoint_finite = true;
  bool deadlines_missed = false;  ///< two consecutive ticks
  bool taken_away = false;        ///< the autopilot left our mode in flight: the pilot's from here on
  bool only_watching = false;     ///< a flying process started again: it sends nothing
};

struct ModeState {
  FlightMode mode = FlightMode::kDisarmed;
  ModeReason reason = ModeReason::kStart;
};

/// Moves `state`; returns true if the mode changed. Realtime-safe: yes.
bool flight_mode_step(const Situation& situation, ModeState& state) WASP_REALTIME;

const char* name_of(FlightMode mode) WASP_REALTIME;
const char* name_of(ModeReason reason) WASP_REALTIME;

}  // namespace wasp::control
