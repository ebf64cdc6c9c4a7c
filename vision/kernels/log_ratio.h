// Holds a positive quantity at a setpoint by pitch: P and I on the logarithm of the ratio, so that twice too fast and
// half too slow weigh alike and the gain does not depend on the unit. Realtime-safe: yes.
#pragma once

#include <algorithm>
#include <cmath>

#include "types/realtime.h"

namespace wasp::vision {

struct RatioParams {
  float p_rad = 0.06f;          ///< pitch for a ratio of e
  float i_radps = 0.02f;        ///< and what it adds each second
  float max_pitch_rad = 0.14f;  ///< 8 degrees, either way
};

struct RatioState {
  float integral_rad = 0;
};

/// Pitch, nose up for `measured` > `setpoint` (> 0). Anything at or below a third of the setpoint counts as a third,
/// beyond three times as three. The integral stands still while the output is at its limit and would go further.
inline float pitch_for_ratio(const RatioParams& p, float measured, float setpoint, float dt_s,
                             RatioState& state) WASP_REALTIME {
  const float ratio = std::clamp(measured / setpoint, 1.f / 3.f, 3.f);
  const float error = std::log(ratio);
  const float limit = std::abs(p.max_pitch_rad);
  const float wanted = p.p_rad * error + state.integral_rad;
  const bool pushes_on = std::abs(wanted) > limit && wanted * error > 0.f;
  if (!pushes_on) state.integral_rad += p.i_radps * error * std::clamp(dt_s, 0.f, 0.2f);
  state.integral_rad = std::clamp(state.integral_rad, -limit, limit);
  return std::clamp(p.p_rad * error + state.integral_rad, -limit, limit);
}

}  // namespace wasp::vision
