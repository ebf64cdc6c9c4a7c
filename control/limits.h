// The guard chain in front of the wire: finite check, range, then rate. What comes out can be sent.
#pragma once

#include "types/realtime.h"

namespace wasp::control {

/// An attitude setpoint on its way to the wire. Yaw is held by the autopilot; wasp commands its rate.
struct Setpoint {
  float roll_rad = 0, pitch_rad = 0;
  float yaw_rate_radps = 0;
  float thrust = 0;  ///< 0 ... 1 of full collective
};

struct LimitParams {
  float max_tilt_rad = 0.26f;  ///< 15 degrees
  float max_tilt_rate_radps = 1.5f;
  float max_yaw_rate_radps = 0.8f;
  float max_yaw_accel_radps2 = 4.f;
  float thrust_min = 0.f, thrust_max = 1.f;
  float max_thrust_rate_1ps = 4.f;
};

/// False, and `setpoint` untouched, if any field of `wanted` is not finite. Else `setpoint`, the last one sent, moves
/// towards `wanted` within range and rate over `dt_s` > 0. Realtime-safe: yes.
bool limit(const LimitParams& params, const Setpoint& wanted, float dt_s, Setpoint& setpoint) WASP_REALTIME;

/// Level and not turning, at once: rates hold back what leads away from neutral, never the way to it. The thrust stays.
/// Realtime-safe: yes.
void level(Setpoint& setpoint) WASP_REALTIME;

}  // namespace wasp::control
