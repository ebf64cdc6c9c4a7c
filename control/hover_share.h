// The share of full collective that carries the vehicle, where an autopilot's own figure is only a guess (PX4's
// MPC_THR_HOVER, 0.5 from the factory). In the air the specific force along the rotors tells it: thrust t gives
// f, so hovering takes t g / f. On the ground nothing tells it: while the vehicle is asked up and does not move, the
// share grows until it does.
#pragma once

#include "types/realtime.h"

namespace wasp::control {

struct HoverShareState {
  float share = 0;        ///< 0: not begun
  float first_guess = 0;  ///< what it began with
};

struct HoverShareInput {
  float guess = 0;          ///< of the autopilot, 0 ... 1
  float sent_thrust = 0;    ///< of the last setpoint
  float force_up_mps2 = 0;  ///< specific force along the rotors, mean since the last tick; 0: not measured
  bool airborne = false;    ///< clear of the ground
  bool asked_up = false;    ///< the height wanted is well above the vehicle
};

/// One period; the share now in force, 0.1 ... 0.95. Realtime-safe: yes.
float hover_share_step(const HoverShareInput& input, float dt_s, HoverShareState& state) WASP_REALTIME;

}  // namespace wasp::control
