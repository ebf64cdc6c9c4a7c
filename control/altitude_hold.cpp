#include "control/altitude_hold.h"

#include <algorithm>

namespace wasp::control {
namespace {
constexpr float kGravity_mps2 = 9.80665f;
constexpr float kLeastCosTilt = 0.5f;  // beyond 60 degrees thrust cannot hold height: do not ask for infinity
}  // namespace

float hover_thrust(const AltitudeHoldParams& p, float cos_tilt) noexcept {
  return std::min(1.f, p.mass_kg * kGravity_mps2 / (p.full_thrust_n * std::max(cos_tilt, kLeastCosTilt)));
}

float altitude_hold_step(const AltitudeHoldParams& p, float target_m, float height_m, float climb_rate_mps,
                         float cos_tilt, float dt_s, AltitudeHoldState& s) noexcept {
  if (!s.engaged) {
    s = AltitudeHoldState{};
    s.setpoint_m = height_m;
    s.engaged = true;
  }
  const float step_m = std::clamp(target_m - s.setpoint_m, -p.max_climb_mps * dt_s, p.max_climb_mps * dt_s);
  s.setpoint_m += step_m;
  const PidParams pid{p.kp_npm, p.ki_npms, p.kd_nspm, -p.max_correction_n, p.max_correction_n};
  const float correction_n = pid_step(pid, s.setpoint_m - height_m, step_m / dt_s - climb_rate_mps, dt_s, s.pid);
  return std::clamp(hover_thrust(p, cos_tilt) + correction_n / (p.full_thrust_n * std::max(cos_tilt, kLeastCosTilt)),
                    0.f, 1.f);
}

}  // namespace wasp::control
