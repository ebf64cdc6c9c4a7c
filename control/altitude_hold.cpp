#include "control/altitude_hold.h"

#include <algorithm>

namespace wasp::control {
namespace {
constexpr float kGravity_mps2 = 9.80665f;
constexpr float kLeastCosTilt = 0.5f;  // beyond 60 degrees thrust cannot hold height: do not ask for infinity

/// Engages where the vehicle is, and moves the setpoint towards the target; returns its step.
float ramp(const AltitudeHoldParams& p, float target_m, float height_m, float dt_s, AltitudeHoldState& s) noexcept {
  if (!s.engaged) {
    s = AltitudeHoldState{};
    s.setpoint_m = height_m;
    s.engaged = true;
  }
  const float step_m = std::clamp(target_m - s.setpoint_m, -p.max_climb_mps * dt_s, p.max_climb_mps * dt_s);
  s.setpoint_m += step_m;
  return step_m;
}

}  // namespace

float hover_thrust(const AltitudeHoldParams& p, float cos_tilt) noexcept {
  return std::min(1.f, p.mass_kg * kGravity_mps2 / (p.full_thrust_n * std::max(cos_tilt, kLeastCosTilt)));
}

float altitude_hold_step(const AltitudeHoldParams& p, float target_m, float height_m, float climb_rate_mps,
                         float cos_tilt, float dt_s, AltitudeHoldState& s) noexcept {
  const float step_m = ramp(p, target_m, height_m, dt_s, s);
  const PidParams pid{p.kp_npm, p.ki_npms, p.kd_nspm, -p.max_correction_n, p.max_correction_n};
  const float correction_n = pid_step(pid, s.setpoint_m - height_m, step_m / dt_s - climb_rate_mps, dt_s, s.pid);
  return std::clamp(hover_thrust(p, cos_tilt) + correction_n / (p.full_thrust_n * std::max(cos_tilt, kLeastCosTilt)),
                    0.f, 1.f);
}

float climb_hold_step(const AltitudeHoldParams& p, float target_m, float height_m, float dt_s,
                      AltitudeHoldState& s) noexcept {
  const float slope_mps = ramp(p, target_m, height_m, dt_s, s) / dt_s;
  const float most_mps = 2 * p.max_climb_mps;
  const PidParams pid{p.climb_kp_1ps, p.climb_ki_1ps2, 0.f, -p.max_climb_mps, p.max_climb_mps};
  return std::clamp(slope_mps + pid_step(pid, s.setpoint_m - height_m, 0.f, dt_s, s.pid), -most_mps, most_mps);
}

}  // namespace wasp::control
