// Thrust from height: PI of (B.16, B.22) with the thesis' gains (K_p = 5 N/m, K_i = 1 N/(m s)) plus damping by the
// filtered climb rate. Without the damping a double integrator under PI swings for ever, as fig. 6.20 shows (+-10 cm).
// Gravity is fed forward and divided by the cosine of the tilt.
#pragma once

#include "control/pid.h"
#include "types/realtime.h"

namespace wasp::control {

struct AltitudeHoldParams {
  float mass_kg = 1.925f;        ///< wasp Kontron Kinect (table A.4)
  float full_thrust_n = 22.4f;   ///< 4 rotors x 5.6 N
  float kp_npm = 5.f;            ///< [N/m]
  float ki_npms = 1.f;           ///< [N/(m s)]
  float kd_nspm = 6.f;           ///< [N s/m]
  float max_climb_mps = 0.4f;    ///< slope of the setpoint ramp
  float max_correction_n = 3.f;  ///< limit of the PID output around the weight
  float climb_kp_1ps = 1.2f;     ///< where a climb rate is asked for in place of thrust: [m/s per m] ...
  float climb_ki_1ps2 = 0.1f;    ///< ... and [m/s per m s]
};

struct AltitudeHoldState {
  PidState pid;
  float setpoint_m = 0;  ///< ramped
  bool engaged = false;
};

/// Hover thrust at this tilt, 0 ... 1 of full collective. `cos_tilt` = R_ned_body(2, 2). Realtime-safe: yes.
float hover_thrust(const AltitudeHoldParams& params, float cos_tilt) WASP_REALTIME;

/// One period: height and climb rate as estimated, target height, `dt_s` > 0. Returns collective 0 ... 1. The setpoint
/// starts where the vehicle is and ramps to the target. Realtime-safe: yes.
float altitude_hold_step(const AltitudeHoldParams& params, float target_m, float height_m, float climb_rate_mps,
                         float cos_tilt, float dt_s, AltitudeHoldState& state) WASP_REALTIME;

/// The same for an autopilot that holds climb rates itself: returns the climb rate to ask for [m/s]. The slope of the
/// ramp is fed forward. Realtime-safe: yes.
float climb_hold_step(const AltitudeHoldParams& params, float target_m, float height_m, float dt_s,
                      AltitudeHoldState& state) WASP_REALTIME;

}  // namespace wasp::control
