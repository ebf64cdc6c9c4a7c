// Velocity over ground between and behind camera frames, in the level frame along the heading: the accelerometer,
// turned level by the attitude, carries the estimate forward at 20 Hz; each cue corrects it at the instant of its
// exposure (a short history is kept). A slow bias state takes up what tilt errors and the accelerometer's own bias add.
#pragma once

#include <array>

#include "types/realtime.h"
#include "types/time.h"

namespace wasp::control {

struct VelocityFilterParams {
  float velocity_gain = 0.35f;      ///< per correction, 0 ... 1
  float bias_gain_1ps = 0.15f;      ///< per correction [1/s]
  float max_innovation_mps = 1.0f;  ///< a cue further away is a jump: believed only after `jumps_to_accept` in a row
  int jumps_to_accept = 5;
  DurationNs max_age_ns = 300 * kMillisecond;  ///< without a cue for longer the velocity counts as unknown
};

/// Forward and right [m/s].
struct LevelVelocity {
  float forward = 0, right = 0;
};

struct VelocityFilterState {
  static constexpr int kHistory = 16;  ///< 0.8 s at 20 Hz
  bool started = false;
  LevelVelocity velocity_mps, bias_mps2;
  TimeNs at_ns = 0, last_exposed_at_ns = kNever;
  int jumps = 0, head = 0, size = 0;
  std::array<TimeNs, kHistory> history_at_ns{};
  std::array<LevelVelocity, kHistory> history{};
};

/// Carries the estimate to `now_ns` under the level acceleration [m/s^2] while the heading turns at `yaw_rate_radps`.
/// Realtime-safe: yes.
void predict(const VelocityFilterParams& params, LevelVelocity accel_mps2, float yaw_rate_radps, TimeNs now_ns,
             VelocityFilterState& state) WASP_REALTIME;

/// Corrects with a velocity seen at `exposed_at_ns`; an exposure not newer than the last is ignored. The first cue, and
/// the first after a gap of `max_age_ns`, starts the filter. Realtime-safe: yes.
void correct(const VelocityFilterParams& params, LevelVelocity seen_mps, TimeNs exposed_at_ns, TimeNs now_ns,
             VelocityFilterState& state) WASP_REALTIME;

/// True while a cue is recent enough. Realtime-safe: yes.
bool known(const VelocityFilterParams& params, const VelocityFilterState& state, TimeNs now_ns) WASP_REALTIME;

}  // namespace wasp::control
