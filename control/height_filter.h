// Height and climb rate between and behind camera frames: the vertical accelerometer carries the estimate forward at
// 20 Hz, each cue corrects it at the instant of its exposure, not of its arrival (a short history of predictions is
// kept). Three fixed gains (height, climb rate, accelerometer bias): a constant-gain Kalman filter.
#pragma once

#include <array>

#include "types/realtime.h"
#include "types/time.h"

namespace wasp::control {

struct HeightFilterParams {
  float height_gain = 0.30f;      ///< per correction, 0 ... 1
  float climb_gain_1ps = 1.2f;    ///< [1/s]
  float bias_gain_1ps2 = 0.25f;   ///< [1/s^2]
  float max_innovation_m = 0.5f;  ///< a cue further away is a jump: believed only after `jumps_to_accept` in a row
  int jumps_to_accept = 5;
};

struct HeightFilterState {
  static constexpr int kHistory = 32;  ///< 1.6 s at 20 Hz
  bool started = false;
  float height_m = 0, climb_rate_mps = 0, accel_bias_mps2 = 0;
  TimeNs at_ns = 0;
  TimeNs last_exposed_at_ns = kNever;
  int jumps = 0;
  int head = 0, size = 0;
  std::array<TimeNs, kHistory> history_at_ns{};
  std::array<float, kHistory> history_height_m{};
};

/// Carries the estimate to `now_ns` under the upward acceleration `accel_up_mps2` (gravity removed). Realtime-safe:
/// yes.
void predict(const HeightFilterParams& params, float accel_up_mps2, TimeNs now_ns,
             HeightFilterState& state) WASP_REALTIME;

/// Corrects with a height seen at `exposed_at_ns`; an exposure not newer than the last is ignored. The first cue starts
/// the filter. Realtime-safe: yes.
void correct(const HeightFilterParams& params, float height_m, TimeNs exposed_at_ns, TimeNs now_ns,
             HeightFilterState& state) WASP_REALTIME;

}  // namespace wasp::control
