// PID (B.16) with output limits and conditional-integration anti-windup. Derivative on measurement, given by the
// caller.
#pragma once

#include "types/realtime.h"

namespace wasp::control {

struct PidParams {
  float kp = 1.f;
  float ki = 0.f;
  float kd = 0.f;
  float output_min = -1.f, output_max = 1.f;
};

struct PidState {
  float integral = 0.f;  ///< ki * integral of the error, in output units
};

/// `error` = setpoint - measurement; `error_rate` its derivative (e.g. setpoint rate minus measured rate); `dt_s` > 0.
/// The integral stands still while the output is saturated in its direction. Realtime-safe: yes.
inline float pid_step(const PidParams& params, float error, float error_rate, float dt_s,
                      PidState& state) WASP_REALTIME {
  const float increment = params.ki * error * dt_s;
  const float wanted = params.kp * error + state.integral + increment + params.kd * error_rate;
  const bool winding_up =
      (wanted > params.output_max && increment > 0) || (wanted < params.output_min && increment < 0);
  if (!winding_up) state.integral += increment;
  const float output = params.kp * error + state.integral + params.kd * error_rate;
  return output < params.output_min ? params.output_min : output > params.output_max ? params.output_max : output;
}

}  // namespace wasp::control
