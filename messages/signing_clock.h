// Time as signatures carry it: 48 bits of 10 us units since 2015-01-01 00:00 GMT, never given out twice and never going
// back (MAVLink guide, "Message Signing").
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "types/realtime.h"
#include "types/time.h"

namespace wasp::mavlink {

inline constexpr std::uint64_t kSigningMinute = 6'000'000;
inline constexpr std::uint64_t kLastSigningTime = (std::uint64_t{1} << 48) - 1;

/// Signing time of a unix time [ns]; 0 before 2015.
constexpr std::uint64_t signing_time_of(TimeNs unix_ns) WASP_REALTIME {
  constexpr TimeNs kEpoch_ns = TimeNs{1420070400} * kSecond, kUnit_ns = 10 * kMicrosecond;
  return unix_ns <= kEpoch_ns ? 0 : static_cast<std::uint64_t>((unix_ns - kEpoch_ns) / kUnit_ns);
}

/// One per link; any thread may take. Realtime-safe: yes, all of it.
class SigningClock {
 public:
  explicit SigningClock(std::uint64_t start) noexcept : next_(start) {}

  /// The time of one message: later than any given out before.
  std::uint64_t take() WASP_REALTIME { return next_.fetch_add(1, std::memory_order_relaxed) & kLastSigningTime; }
  /// Goes on from `units` if that is ahead. Who is overtaken by other threads leaves it to the next call.
  void advance_to(std::uint64_t units) WASP_REALTIME {
    std::uint64_t at = next_.load(std::memory_order_relaxed);
    for (int tries = 0; tries < 4 && at < units; ++tries)
      if (next_.compare_exchange_weak(at, units, std::memory_order_relaxed)) return;
  }
  [[nodiscard]] std::uint64_t now() const WASP_REALTIME { return next_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> next_;
};

}  // namespace wasp::mavlink
