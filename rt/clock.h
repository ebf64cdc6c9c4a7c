// CLOCK_MONOTONIC: the only clock of a flight. Wall time exists in file names only.
#pragma once

#include <cerrno>
#include <ctime>

#include "rt/contract.h"
#include "types/time.h"

namespace wasp::rt {

/// Nanoseconds on CLOCK_MONOTONIC. Realtime-safe: yes (vDSO, no system call).
inline TimeNs now() WASP_REALTIME {
  timespec ts{};
  clock_gettime(CLOCK_MONOTONIC, &ts);
  return static_cast<TimeNs>(ts.tv_sec) * kSecond + ts.tv_nsec;
}

constexpr timespec to_timespec(TimeNs t) noexcept {
  return {static_cast<time_t>(t / kSecond), static_cast<long>(t % kSecond)};
}

/// Sleeps until the absolute instant; returns at once if it has passed (or is kNever). Signals do not shorten it.
/// Realtime-safe: yes (clock_nanosleep).
inline void sleep_until(TimeNs instant) WASP_REALTIME {
  const timespec ts = to_timespec(instant);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &ts, nullptr) == EINTR) {
  }
}

}  // namespace wasp::rt
