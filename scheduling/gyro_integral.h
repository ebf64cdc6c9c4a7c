// The turn between any two instants of the last seconds by the gyro: a running integral (trapezoids), read at both.
#pragma once

#include <array>
#include <optional>

#include "types/messages.h"
#include "types/realtime.h"

namespace wasp::scheduling {

class GyroIntegral {
 public:
  static constexpr DurationNs kLongestGap = 100 * kMillisecond;

  /// Samples in order of their times; others are passed over. Realtime-safe: yes.
  void add(const ImuSample& sample) WASP_REALTIME {
    if (count_ > 0 && sample.exposed_at_ns <= newest().at_ns) return;
    Point p{sample.exposed_at_ns, {}, sample.gyro_body_radps, 1};
    if (count_ > 0) {
      const Point& last = newest();
      const DurationNs step_ns = p.at_ns - last.at_ns;
      const double half_s = 0.5 * to_seconds(step_ns);
      p.run = step_ns <= kLongestGap ? last.run : last.run + 1;
      for (std::size_t k = 0; k < 3; ++k)
        p.sum_rad[k] = last.sum_rad[k] + half_s * static_cast<double>(last.rate_radps[k] + p.rate_radps[k]);
    }
    points_[count_++ % points_.size()] = p;
  }

  /// nullopt where samples are missing at either end or between. Realtime-safe: yes.
  [[nodiscard]] std::optional<std::array<float, 3>> between(TimeNs from_ns, TimeNs to_ns) const WASP_REALTIME {
    Point a, b;
    if (!at(from_ns, a) || !at(to_ns, b) || a.run != b.run) return std::nullopt;
    std::array<float, 3> turn{};
    for (std::size_t k = 0; k < 3; ++k) turn[k] = static_cast<float>(b.sum_rad[k] - a.sum_rad[k]);
    return turn;
  }

 private:
  struct Point {
    TimeNs at_ns = 0;
    std::array<double, 3> sum_rad{};
    std::array<float, 3> rate_radps{};
    std::uint32_t run = 0;  ///< of samples without a gap
  };
  [[nodiscard]] const Point& newest() const WASP_REALTIME { return points_[(count_ - 1) % points_.size()]; }

  /// Between the two samples around it.
  bool at(TimeNs at_ns, Point& out) const WASP_REALTIME {
    for (std::size_t n = count_; n > 1 && count_ - n < points_.size() - 1; --n) {
      const Point& before = points_[(n - 2) % points_.size()];
      const Point& after = points_[(n - 1) % points_.size()];
      if (before.at_ns > at_ns) continue;
      if (after.at_ns < at_ns || before.run != after.run) return false;
      const double since_s = to_seconds(at_ns - before.at_ns), whole_s = to_seconds(after.at_ns - before.at_ns);
      out.run = before.run;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto r0 = static_cast<double>(before.rate_radps[k]), r1 = static_cast<double>(after.rate_radps[k]);
        out.sum_rad[k] = before.sum_rad[k] + since_s * (r0 + 0.5 * (r1 - r0) * since_s / whole_s);
      }
      return true;
    }
    return false;
  }

  std::array<Point, 512> points_{};
  std::size_t count_ = 0;
};

}  // namespace wasp::scheduling
