#include "control/velocity_hold.h"

#include <algorithm>
#include <cmath>

namespace wasp::control {
namespace {

constexpr float kGravity_mps2 = 9.80665f;

/// PI with a limited integral that stands still while the output is at its limit.
float axis(const VelocityHoldParams& p, float error, float dt_s, float& integral) noexcept {
  const float wanted = p.kp_1ps * error + integral;
  if (std::fabs(wanted) < p.max_accel_mps2)
    integral = std::clamp(integral + p.ki_1ps2 * error * dt_s, -p.max_integral_mps2, p.max_integral_mps2);
  return std::clamp(p.kp_1ps * error + integral, -p.max_accel_mps2, p.max_accel_mps2);
}

}  // namespace

Tilt velocity_hold_step(const VelocityHoldParams& p, float forward_mps, bool is_known, LevelVelocity measured,
                        float yaw_rate_radps, float dt_s, VelocityHoldState& s) noexcept {
  if (!is_known || p.hold == VelocityHold::kOff) {
    s = VelocityHoldState{};
    return {};
  }
  const bool braking = std::fabs(forward_mps) < std::fabs(s.setpoint_mps);
  s.setpoint_mps =
      braking ? forward_mps
              : s.setpoint_mps + std::clamp(forward_mps - s.setpoint_mps, -p.ramp_mps2 * dt_s, p.ramp_mps2 * dt_s);
  const float ahead = axis(p, s.setpoint_mps - measured.forward, dt_s, s.integral_mps2.forward);
  const float banked = measured.forward * yaw_rate_radps + axis(p, -measured.right, dt_s, s.integral_mps2.right);
  const float right = std::clamp(banked, -p.max_accel_mps2, p.max_accel_mps2);
  return {std::atan2(right, kGravity_mps2), p.hold == VelocityHold::kBoth ? -std::atan2(ahead, kGravity_mps2) : 0.f};
}

}  // namespace wasp::control
