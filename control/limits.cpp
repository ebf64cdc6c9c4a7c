#include "control/limits.h"

#include <algorithm>
#include <cmath>

namespace wasp::control {
namespace {

float towards(float from, float to, float low, float high, float step) noexcept {
  return std::clamp(from + std::clamp(std::clamp(to, low, high) - from, -step, step), low, high);
}

}  // namespace

bool limit(const LimitParams& p, const Setpoint& w, float dt_s, Setpoint& s) noexcept {
  if (!std::isfinite(w.roll_rad) || !std::isfinite(w.pitch_rad) || !std::isfinite(w.yaw_rate_radps) ||
      !std::isfinite(w.thrust))
    return false;
  const float tilt_step = p.max_tilt_rate_radps * dt_s;
  s.roll_rad = towards(s.roll_rad, w.roll_rad, -p.max_tilt_rad, p.max_tilt_rad, tilt_step);
  s.pitch_rad = towards(s.pitch_rad, w.pitch_rad, -p.max_tilt_rad, p.max_tilt_rad, tilt_step);
  s.yaw_rate_radps = towards(s.yaw_rate_radps, w.yaw_rate_radps, -p.max_yaw_rate_radps, p.max_yaw_rate_radps,
                             p.max_yaw_accel_radps2 * dt_s);
  s.thrust = towards(s.thrust, w.thrust, p.thrust_min, p.thrust_max, p.max_thrust_rate_1ps * dt_s);
  return true;
}

void level(Setpoint& s) noexcept { s = {.thrust = s.thrust}; }

}  // namespace wasp::control
