// What a setpoint means to the autopilot at the other end, in force now: found out before arming (drivers/
// autopilot_setup.h) and obeyed by control_step. One layer, so that nothing else of control knows which one flies.
#pragma once

namespace wasp {

/// What the thrust field of a setpoint means.
enum class VerticalChannel : unsigned char {
  kThrust,    ///< collective, 0 ... 1
  kClimbRate  ///< 0.5 holds the height, 1 climbs and 0 sinks as fast as the autopilot is allowed to
};

struct AutopilotSemantics {
  VerticalChannel vertical = VerticalChannel::kThrust;
  float hover_share = 0;     ///< kThrust: collective that carries the vehicle; 0: from its mass and full thrust
  bool learn_hover = false;  ///< `hover_share` is a first guess: corrected from the specific force in flight
  float climb_at_full_mps = 2.5f, sink_at_zero_mps = 1.5f;  ///< kClimbRate: what 1 and 0 mean
  bool heading_by_angle = false;  ///< the quaternion carries the heading wanted, not the heading that is
  bool heading_rate_used = true;  ///< the yaw rate goes out beside it
  bool silent_when_left = false;  ///< no setpoints while the autopilot is in another mode; the mission ends
};

/// The thrust field that asks for `climb_mps`; clamped to 0 ... 1. Realtime-safe: yes.
constexpr float climb_field(const AutopilotSemantics& s, float climb_mps) noexcept {
  const float share = 0.5f + 0.5f * climb_mps / (climb_mps > 0 ? s.climb_at_full_mps : s.sink_at_zero_mps);
  return share < 0.f ? 0.f : share > 1.f ? 1.f : share;
}

}  // namespace wasp
