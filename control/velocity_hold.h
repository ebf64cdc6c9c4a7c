// Tilt from velocity: PI on the level velocity over ground, the wanted acceleration becomes pitch and roll. Sideways
// the vehicle is held at rest, so that steering by heading alone does not skid from wall to wall.
#pragma once

#include <cstdint>

#include "control/velocity_filter.h"
#include "types/realtime.h"

namespace wasp::control {

/// What is held: nothing, the way to the sides alone (behaviours pitch for speed), or both.
enum class VelocityHold : std::uint8_t { kOff, kSideways, kBoth };

struct VelocityHoldParams {
  VelocityHold hold = VelocityHold::kOff;
  float kp_1ps = 1.4f;             ///< [1/s]
  float ki_1ps2 = 0.35f;           ///< [1/s^2]
  float max_accel_mps2 = 1.7f;     ///< of the command: 10 degrees of tilt
  float max_integral_mps2 = 0.6f;  ///< wind and drag
  float ramp_mps2 = 0.8f;          ///< slope of the forward setpoint; braking is not ramped
};

struct VelocityHoldState {
  LevelVelocity integral_mps2;
  float setpoint_mps = 0;  ///< forward, ramped
};

struct Tilt {
  float roll_rad = 0, pitch_rad = 0;
};

/// One period towards `forward_mps`. `measured` where `is_known`; otherwise level, and integral and ramp start anew. A
/// turn at `yaw_rate_radps` (as commanded: it takes as long to come as the roll) is banked for, v times the rate, or
/// the way over ground would follow the heading late and steering by heading would swing. Realtime-safe: yes.
Tilt velocity_hold_step(const VelocityHoldParams& params, float forward_mps, bool is_known, LevelVelocity measured,
                        float yaw_rate_radps, float dt_s, VelocityHoldState& state) WASP_REALTIME;

}  // namespace wasp::control
