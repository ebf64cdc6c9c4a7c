// A periodic grid that an overrun never moves. Release k is due at start + k * period for ever; a thread that comes
// back late finds the next due release in the future and is told how many it missed. Latency is counted from the
// intended release (no coordinated omission).
#pragma once

#include <cstdint>

#include "rt/clock.h"

namespace wasp::rt {

/// One wake-up on the grid.
struct Release {
  std::uint64_t index = 0;    ///< k on the grid
  TimeNs due_at_ns = 0;       ///< start + k * period
  TimeNs released_at_ns = 0;  ///< when the thread ran
  std::uint64_t skipped = 0;  ///< releases passed over since the last one
};

/// Pure arithmetic of the grid, testable without a clock.
class PeriodicGrid {
 public:
  /// `period_ns` > 0. The first release is due at `start_ns`.
  constexpr PeriodicGrid(TimeNs start_ns, DurationNs period_ns) noexcept : start_ns_(start_ns), period_ns_(period_ns) {}

  [[nodiscard]] constexpr TimeNs due(std::uint64_t index) const noexcept {
    return start_ns_ + static_cast<DurationNs>(index) * period_ns_;
  }

  /// Skip and count: the release to wait for is the first one not yet due at `now_ns`. A release that fell due while
  /// the thread was still busy is skipped, never served late in secret: a 130 ms stall at 20 Hz skips exactly two.
  constexpr Release next(TimeNs now_ns) noexcept {
    Release release;
    const std::uint64_t wanted = next_;
    std::uint64_t index = wanted;
    if (now_ns > due(wanted)) index = static_cast<std::uint64_t>((now_ns - start_ns_ + period_ns_ - 1) / period_ns_);
    release.index = index;
    release.due_at_ns = due(index);
    release.skipped = index - wanted;
    next_ = index + 1;
    return release;
  }

 private:
  TimeNs start_ns_;
  DurationNs period_ns_;
  std::uint64_t next_ = 0;
};

/// Sleeps to the next release of the grid. Realtime-safe: yes.
inline Release wait_next(PeriodicGrid& grid) WASP_REALTIME {
  Release release = grid.next(now());
  sleep_until(release.due_at_ns);
  release.released_at_ns = now();
  return release;
}

}  // namespace wasp::rt
