// An attitude at another instant than its sample's.
#pragma once

#include <algorithm>
#include <cmath>

#include "types/frames.h"
#include "types/messages.h"
#include "types/realtime.h"

namespace wasp {

inline constexpr DurationNs kLongestTurnOn = 50 * kMillisecond;

/// `sample` turned on by its own body rates to `at_ns`, at most kLongestTurnOn either way; q <- q exp(w dt). Rates that
/// are not finite leave it as it is, but for the time. Realtime-safe: yes.
inline AttitudeSample attitude_turned_on(AttitudeSample sample, TimeNs at_ns) WASP_REALTIME {
  const DurationNs dt_ns = std::clamp(at_ns - sample.exposed_at_ns, -kLongestTurnOn, kLongestTurnOn);
  const auto& w = sample.rate_body_radps;
  const float rate = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  sample.exposed_at_ns = at_ns;
  if (!std::isfinite(rate) || rate < 1e-6f) return sample;
  const float half = 0.5f * rate * static_cast<float>(to_seconds(dt_ns));
  const float s = std::sin(half) / rate;
  const auto& q = sample.q_ned_body;
  const Quat turned = Quat(q[0], q[1], q[2], q[3]) * Quat(std::cos(half), s * w[0], s * w[1], s * w[2]);
  sample.q_ned_body = {turned.w(), turned.x(), turned.y(), turned.z()};
  return sample;
}

}  // namespace wasp
