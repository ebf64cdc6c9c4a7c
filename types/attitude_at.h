// Attitude at an instant between or after the samples of an estimator: the sample before it, turned on by its rates.
#pragma once

#include <algorithm>
#include <cmath>

#include "types/messages.h"
#include "types/realtime.h"

namespace wasp {

/// Longest time a sample is turned on by rates; an instant further away gets the attitude of that moment.
inline constexpr DurationNs kLongestTurn = 50 * kMillisecond;

/// q after turning at a constant body rate for `seconds`: q exp(rate / 2 * seconds). Realtime-safe: yes.
inline std::array<float, 4> turned(const std::array<float, 4>& q, const std::array<float, 3>& rate_body_radps,
                                   float seconds) WASP_REALTIME {
  const float x = rate_body_radps[0] * seconds, y = rate_body_radps[1] * seconds, z = rate_body_radps[2] * seconds;
  const float angle = std::sqrt(x * x + y * y + z * z);
  if (!std::isfinite(angle)) return q;
  const float c = std::cos(0.5f * angle), s = angle > 1e-6f ? std::sin(0.5f * angle) / angle : 0.5f;
  const float dx = s * x, dy = s * y, dz = s * z;
  return {q[0] * c - q[1] * dx - q[2] * dy - q[3] * dz, q[0] * dx + q[1] * c + q[2] * dz - q[3] * dy,
          q[0] * dy - q[1] * dz + q[2] * c + q[3] * dx, q[0] * dz + q[1] * dy - q[2] * dx + q[3] * c};
}

/// Attitude and rates at `at_ns`. `before` is the newest sample not after it; `after`, if not nullptr, the next one.
/// With both, no more than kLongestTurn apart, rates are interpolated and the turn is made at their mean from `before`
/// on, which is exact for a rate that changes linearly about a fixed axis; with `before` alone its rates are held.
/// Rates that are not finite turn nothing. Realtime-safe: yes.
inline AttitudeSample attitude_at(const AttitudeSample& before, const AttitudeSample* after,
                                  TimeNs at_ns) WASP_REALTIME {
  AttitudeSample out = before;
  out.exposed_at_ns = at_ns;
  const DurationNs turn_ns = std::clamp<DurationNs>(at_ns - before.exposed_at_ns, 0, kLongestTurn);
  std::array<float, 3> mean = before.rate_body_radps;
  if (after != nullptr && after->exposed_at_ns >= at_ns && after->exposed_at_ns > before.exposed_at_ns &&
      after->exposed_at_ns - before.exposed_at_ns <= kLongestTurn) {
    const float share = static_cast<float>(turn_ns) / static_cast<float>(after->exposed_at_ns - before.exposed_at_ns);
    for (std::size_t i = 0; i < 3; ++i) {
      const float change = share * (after->rate_body_radps[i] - before.rate_body_radps[i]);
      out.rate_body_radps[i] += change;
      mean[i] += 0.5f * change;
    }
  }
  out.q_ned_body = turned(before.q_ned_body, mean, static_cast<float>(to_seconds(turn_ns)));
  return out;
}

}  // namespace wasp
