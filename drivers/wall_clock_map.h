// Time stamps of the wall clock (libdc1394: gettimeofday, microseconds) on CLOCK_MONOTONIC. Both clocks are read when
// the frame is taken; what matters is how long ago the stamp was, so a wall clock that is set, or a year ahead, does no
// harm. Only a step between the stamp and the reading would: then the age is absurd, or the two clocks have moved apart
// since the frame before, and the stamp is not believed. Pure.
#pragma once

#include <cstdint>
#include <optional>

#include "types/time.h"

namespace wasp::drivers {

/// Both clocks at one instant.
struct ClockPair {
  TimeNs monotonic_ns = 0;
  std::int64_t wall_ns = 0;
};

class WallClockMap {
 public:
  static constexpr DurationNs kStep = 2 * kMillisecond;  ///< more than NTP slews between two frames
  static constexpr DurationNs kOldest = kSecond;

  /// CLOCK_MONOTONIC of the stamp; empty if it cannot be believed. Call once a frame. Realtime-safe: yes.
  std::optional<TimeNs> to_monotonic(std::int64_t stamp_wall_ns, const ClockPair& now) noexcept {
    const std::int64_t offset_ns = now.wall_ns - now.monotonic_ns;
    const bool stepped = known_ && (offset_ns - offset_ns_ > kStep || offset_ns_ - offset_ns > kStep);
    offset_ns_ = offset_ns;
    known_ = true;
    const DurationNs age_ns = now.wall_ns - stamp_wall_ns;
    if (stepped || age_ns < 0 || age_ns > kOldest) return std::nullopt;
    return now.monotonic_ns - age_ns;
  }

 private:
  std::int64_t offset_ns_ = 0;
  bool known_ = false;
};

}  // namespace wasp::drivers
