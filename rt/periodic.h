// A periodic grid that an overrun never moves. Release k is due at start + k * period for ever; what happens to
// releases that fell due while the thread was still busy is a stated policy. Latency is counted from the intended
// release (no coordinated omission).
#pragma once

#include <cstdint>

#include "rt/clock.h"

namespace wasp::rt {

/// What becomes of releases that fell due while the thread was busy. The grid is the same under all three.
enum class OverrunPolicy : std::uint8_t {
  kSkip,     ///< passed over and counted; the next release served lies in the future
  kCatchUp,  ///< served late, in turn, at most kCatchUpBurst in a row; older ones are passed over and counted
  kStop      ///< as kSkip; the owner of the loop ends its work in order (a flight lands)
};

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
  /// Most overdue releases served in a row under kCatchUp: a thread that is always late must not run without pause.
  static constexpr std::uint64_t kCatchUpBurst = 4;

  /// `period_ns` > 0. The first release is due at `start_ns`.
  constexpr PeriodicGrid(TimeNs start_ns, DurationNs period_ns, OverrunPolicy policy = OverrunPolicy::kSkip) noexcept
      : start_ns_(start_ns), period_ns_(period_ns), policy_(policy) {}

  [[nodiscard]] constexpr TimeNs due(std::uint64_t index) const noexcept {
    return start_ns_ + static_cast<DurationNs>(index) * period_ns_;
  }

  /// The release to wait for at `now_ns`: the first one not yet due, or, while catching up, an overdue one. What is
  /// passed over is counted, never served late in secret: a 130 ms stall at 20 Hz skips exactly two.
  constexpr Release next(TimeNs now_ns) noexcept {
    const std::uint64_t overdue = overdue_at(now_ns);
    std::uint64_t skipped = overdue;
    if (overdue == 0) {
      burst_left_ = kCatchUpBurst;
    } else if (policy_ == OverrunPolicy::kCatchUp && burst_left_ > 0) {
      skipped = overdue > burst_left_ ? overdue - burst_left_ : 0;
      --burst_left_;
    } else {
      burst_left_ = kCatchUpBurst;
    }
    Release release;
    release.index = next_ + skipped;
    release.due_at_ns = due(release.index);
    release.skipped = skipped;
    next_ = release.index + 1;
    return release;
  }

 private:
  /// Releases not yet served that were due before `now_ns`.
  [[nodiscard]] constexpr std::uint64_t overdue_at(TimeNs now_ns) const noexcept {
    if (now_ns <= due(next_)) return 0;
    return static_cast<std::uint64_t>((now_ns - start_ns_ + period_ns_ - 1) / period_ns_) - next_;
  }

  TimeNs start_ns_;
  DurationNs period_ns_;
  OverrunPolicy policy_;
  std::uint64_t next_ = 0;
  std::uint64_t burst_left_ = kCatchUpBurst;
};

/// The first release after the one due at `due_ns` that is not yet due at `now_ns`: what a thread that skips waits for.
constexpr TimeNs next_due(TimeNs due_ns, DurationNs period_ns, TimeNs now_ns) WASP_REALTIME {
  const TimeNs next_ns = due_ns + period_ns;
  return now_ns <= next_ns ? next_ns : next_ns + (now_ns - next_ns + period_ns - 1) / period_ns * period_ns;
}

/// Sleeps to the next release of the grid; an overdue one is returned at once. Realtime-safe: yes.
inline Release wait_next(PeriodicGrid& grid) WASP_REALTIME {
  Release release = grid.next(now());
  sleep_until(release.due_at_ns);
  release.released_at_ns = now();
  return release;
}

}  // namespace wasp::rt
