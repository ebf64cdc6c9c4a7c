// Time: CLOCK_MONOTONIC nanoseconds in a signed 64-bit integer, everywhere.
// Types know no clock: `now` lives in rt/clock.h.
#pragma once

#include <cstdint>

namespace wasp {

using TimeNs = std::int64_t;      ///< an instant, CLOCK_MONOTONIC [ns]
using DurationNs = std::int64_t;  ///< a difference of two instants [ns]

inline constexpr TimeNs kNever = INT64_MIN;  ///< "has not happened"
inline constexpr TimeNs kForever = INT64_MAX;  ///< "does not happen"
inline constexpr DurationNs kMicrosecond = 1'000;
inline constexpr DurationNs kMillisecond = 1'000'000;
inline constexpr DurationNs kSecond = 1'000'000'000;

constexpr double to_seconds(DurationNs duration) noexcept { return static_cast<double>(duration) * 1e-9; }
constexpr DurationNs from_seconds(double seconds) noexcept { return static_cast<DurationNs>(seconds * 1e9); }

}  // namespace wasp
