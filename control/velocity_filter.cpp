#include "control/velocity_filter.h"

#include <algorithm>
#include <cmath>

namespace wasp::control {
namespace {

constexpr float kMaxAccel_mps2 = 15.f;  // more is a broken sensor

void remember(VelocityFilterState& s) noexcept {
  s.history_at_ns[static_cast<std::size_t>(s.head)] = s.at_ns;
  s.history[static_cast<std::size_t>(s.head)] = s.velocity_mps;
  s.head = (s.head + 1) % VelocityFilterState::kHistory;
  s.size = std::min(s.size + 1, VelocityFilterState::kHistory);
}

void start(LevelVelocity seen, TimeNs exposed_at_ns, TimeNs now_ns, VelocityFilterState& s) noexcept {
  s = VelocityFilterState{};
  s.started = true;
  s.velocity_mps = seen;
  s.at_ns = now_ns;
  s.last_exposed_at_ns = exposed_at_ns;
  remember(s);
}

/// What the filter believed in at `at_ns`: the nearest prediction not after it, the oldest where there is none.
LevelVelocity believed_at(const VelocityFilterState& s, TimeNs at_ns) noexcept {
  constexpr int n = VelocityFilterState::kHistory;
  LevelVelocity newer = s.velocity_mps;
  TimeNs newer_at_ns = s.at_ns;
  for (int i = 1; i <= s.size; ++i) {
    const auto k = static_cast<std::size_t>((s.head - i + n) % n);
    if (s.history_at_ns[k] <= at_ns) {
      const auto span = static_cast<float>(newer_at_ns - s.history_at_ns[k]);
      const float part = span > 0 ? std::fmin(1.f, static_cast<float>(at_ns - s.history_at_ns[k]) / span) : 0.f;
      return {s.history[k].forward + part * (newer.forward - s.history[k].forward),
              s.history[k].right + part * (newer.right - s.history[k].right)};
    }
    newer = s.history[k];
    newer_at_ns = s.history_at_ns[k];
  }
  return newer;
}

float believable(float a) noexcept { return std::isfinite(a) ? std::clamp(a, -kMaxAccel_mps2, kMaxAccel_mps2) : 0.f; }

}  // namespace

void predict(const VelocityFilterParams&, LevelVelocity accel, float yaw_rate_radps, TimeNs now_ns,
             VelocityFilterState& s) noexcept {
  if (!s.started) return;
  const auto dt_s = static_cast<float>(to_seconds(now_ns - s.at_ns));
  if (dt_s <= 0) return;
  const float turn = std::isfinite(yaw_rate_radps) ? std::clamp(yaw_rate_radps * dt_s, -1.f, 1.f) : 0.f;
  const float c = std::cos(turn), n = std::sin(turn);
  const LevelVelocity v = s.velocity_mps;
  // The frame turns with the heading: what was ahead comes from the left of a right turn.
  s.velocity_mps = {c * v.forward + n * v.right + (believable(accel.forward) - s.bias_mps2.forward) * dt_s,
                    c * v.right - n * v.forward + (believable(accel.right) - s.bias_mps2.right) * dt_s};
  s.at_ns = now_ns;
  remember(s);
}

void correct(const VelocityFilterParams& p, LevelVelocity seen, TimeNs exposed_at_ns, TimeNs now_ns,
             VelocityFilterState& s) noexcept {
  if (!std::isfinite(seen.forward) || !std::isfinite(seen.right)) return;
  if (!s.started || exposed_at_ns - s.last_exposed_at_ns > p.max_age_ns) return start(seen, exposed_at_ns, now_ns, s);
  if (exposed_at_ns <= s.last_exposed_at_ns) return;
  s.last_exposed_at_ns = exposed_at_ns;
  const LevelVelocity then = believed_at(s, exposed_at_ns);
  const LevelVelocity off{seen.forward - then.forward, seen.right - then.right};
  if (std::hypot(off.forward, off.right) > p.max_innovation_mps) {
    if (++s.jumps >= p.jumps_to_accept) start(seen, exposed_at_ns, now_ns, s);
    return;
  }
  s.jumps = 0;
  const LevelVelocity step{p.velocity_gain * off.forward, p.velocity_gain * off.right};
  s.velocity_mps = {s.velocity_mps.forward + step.forward, s.velocity_mps.right + step.right};
  s.bias_mps2 = {s.bias_mps2.forward - p.bias_gain_1ps * off.forward, s.bias_mps2.right - p.bias_gain_1ps * off.right};
  for (LevelVelocity& v : s.history) v = {v.forward + step.forward, v.right + step.right};
}

bool known(const VelocityFilterParams& p, const VelocityFilterState& s, TimeNs now_ns) noexcept {
  return s.started && now_ns - s.last_exposed_at_ns <= p.max_age_ns;
}

}  // namespace wasp::control
