#include "control/height_filter.h"

#include <algorithm>
#include <cmath>

namespace wasp::control {
namespace {

constexpr float kMaxAccel_mps2 = 30.f;  // three times gravity: more is a broken sensor

void remember(HeightFilterState& s) noexcept {
  s.history_at_ns[static_cast<std::size_t>(s.head)] = s.at_ns;
  s.history_height_m[static_cast<std::size_t>(s.head)] = s.height_m;
  s.head = (s.head + 1) % HeightFilterState::kHistory;
  if (s.size < HeightFilterState::kHistory) ++s.size;
}

/// The height the filter believed in at `at_ns`: linear between predictions, the oldest or newest outside them.
float believed_at(const HeightFilterState& s, TimeNs at_ns) noexcept {
  constexpr int n = HeightFilterState::kHistory;
  float newer_height = s.height_m;
  TimeNs newer_at = s.at_ns;
  for (int i = 1; i <= s.size; ++i) {
    const auto k = static_cast<std::size_t>((s.head - i + n) % n);
    if (s.history_at_ns[k] <= at_ns) {
      const auto span = static_cast<float>(newer_at - s.history_at_ns[k]);
      const float part = span > 0 ? static_cast<float>(at_ns - s.history_at_ns[k]) / span : 0.f;
      return s.history_height_m[k] + std::fmin(1.f, part) * (newer_height - s.history_height_m[k]);
    }
    newer_height = s.history_height_m[k];
    newer_at = s.history_at_ns[k];
  }
  return newer_height;
}

void start(float height_m, TimeNs exposed_at_ns, TimeNs now_ns, HeightFilterState& s) noexcept {
  s = HeightFilterState{};
  s.started = true;
  s.height_m = height_m;
  s.at_ns = now_ns;
  s.last_exposed_at_ns = exposed_at_ns;
  remember(s);
}

}  // namespace

void predict(const HeightFilterParams&, float accel_up_mps2, TimeNs now_ns, HeightFilterState& s) noexcept {
  if (!s.started) return;
  const auto dt_s = static_cast<float>(to_seconds(now_ns - s.at_ns));
  if (dt_s <= 0) return;
  const float believable =
      std::isfinite(accel_up_mps2) ? std::clamp(accel_up_mps2, -kMaxAccel_mps2, kMaxAccel_mps2) : 0.f;
  const float a = believable - s.accel_bias_mps2;
  s.height_m += s.climb_rate_mps * dt_s + 0.5f * a * dt_s * dt_s;
  s.climb_rate_mps += a * dt_s;
  s.at_ns = now_ns;
  remember(s);
}

void correct(const HeightFilterParams& p, float height_m, TimeNs exposed_at_ns, TimeNs now_ns,
             HeightFilterState& s) noexcept {
  if (!std::isfinite(height_m)) return;
  if (!s.started) return start(height_m, exposed_at_ns, now_ns, s);
  if (exposed_at_ns <= s.last_exposed_at_ns) return;
  s.last_exposed_at_ns = exposed_at_ns;
  const float innovation_m = height_m - believed_at(s, exposed_at_ns);
  if (std::fabs(innovation_m) > p.max_innovation_m) {
    if (++s.jumps >= p.jumps_to_accept) start(height_m, exposed_at_ns, now_ns, s);
    return;
  }
  s.jumps = 0;
  const float step_m = p.height_gain * innovation_m;
  s.height_m += step_m;
  s.climb_rate_mps += p.climb_gain_1ps * innovation_m;
  s.accel_bias_mps2 -= p.bias_gain_1ps2 * innovation_m;
  for (float& h : s.history_height_m) h += step_m;  // later cues compare against the corrected past
}

}  // namespace wasp::control
