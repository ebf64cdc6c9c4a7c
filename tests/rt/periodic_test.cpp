// The grid on virtual time, beside the wrong algorithm that "resets the grid to now" after an overrun.
#include "rt/periodic.h"

#include <gtest/gtest.h>

#include <vector>

namespace wasp::rt {
namespace {

constexpr DurationNs kPeriod = 50 * kMillisecond;
constexpr TimeNs kStart = 1234567891;

/// The classic mistake: after an overrun the next release is one period after whatever the time is.
class ResettingGrid {
 public:
  ResettingGrid(TimeNs start_ns, DurationNs period_ns) : due_ns_(start_ns), period_ns_(period_ns) {}
  Release next(TimeNs now_ns) {
    if (now_ns > due_ns_) due_ns_ = now_ns + period_ns_;
    const Release release{index_++, due_ns_, 0, 0};
    due_ns_ += period_ns_;
    return release;
  }

 private:
  TimeNs due_ns_;
  DurationNs period_ns_;
  std::uint64_t index_ = 0;
};

/// Twenty ticks of 1 ms work each, wake-ups 70 us late, and one stall of 130 ms in tick 7.
template <class Grid>
std::vector<Release> run_with_stall(Grid grid) {
  std::vector<Release> releases;
  TimeNs now_ns = kStart - kMillisecond;
  for (int tick = 0; tick < 20; ++tick) {
    Release release = grid.next(now_ns);
    release.released_at_ns = release.due_at_ns + 70 * kMicrosecond;
    releases.push_back(release);
    now_ns = release.due_at_ns + (tick == 7 ? 130 * kMillisecond : kMillisecond);
  }
  return releases;
}

/// The check both variants face: every release on the first grid, exactly two skipped and counted.
bool keeps_the_grid(const std::vector<Release>& releases) {
  std::uint64_t skipped = 0;
  for (const auto& r : releases) {
    if ((r.due_at_ns - kStart) % kPeriod != 0) return false;
    if (r.due_at_ns != kStart + static_cast<DurationNs>(r.index) * kPeriod) return false;
    skipped += r.skipped;
  }
  return skipped == 2 && releases.back().index == releases.size() - 1 + 2;
}

TEST(PeriodicGrid, StallOf130MillisecondsAt20HertzSkipsExactlyTwo) {
  const auto releases = run_with_stall(PeriodicGrid(kStart, kPeriod));
  EXPECT_TRUE(keeps_the_grid(releases));
  EXPECT_EQ(releases[7].index, 7u);
  EXPECT_EQ(releases[8].index, 10u);
  EXPECT_EQ(releases[8].skipped, 2u);
  EXPECT_EQ(releases[9].skipped, 0u);
}

TEST(PeriodicGrid, ResettingTheGridToNowFailsTheSameCheck) {
  EXPECT_FALSE(keeps_the_grid(run_with_stall(ResettingGrid(kStart, kPeriod))));
}

TEST(PeriodicGrid, ReleaseDueAtThisVeryInstantIsServed) {
  PeriodicGrid grid(kStart, kPeriod);
  EXPECT_EQ(grid.next(kStart).skipped, 0u);
  EXPECT_EQ(grid.next(kStart + kPeriod).skipped, 0u);
  EXPECT_EQ(grid.next(kStart + 2 * kPeriod + 1).skipped, 1u);  // one nanosecond late: skipped, not served in secret
}

TEST(PeriodicGrid, NeverReleasesThePastAndNeverMovesOverAnyStall) {
  for (DurationNs stall = 0; stall < 7 * kPeriod; stall += 777'777) {
    PeriodicGrid grid(kStart, kPeriod);
    const Release first = grid.next(kStart);
    const Release after = grid.next(first.due_at_ns + stall);
    EXPECT_GE(after.due_at_ns, first.due_at_ns + stall);
    EXPECT_LT(after.due_at_ns - (first.due_at_ns + stall), kPeriod + (stall == 0 ? 1 : 0));
    EXPECT_EQ((after.due_at_ns - kStart) % kPeriod, 0);
    EXPECT_EQ(after.index, 1 + after.skipped);
  }
}

TEST(PeriodicGrid, WhatIsDueNextIsWhatSkippingWaitsFor) {
  constexpr DurationNs kTick = 50 * kMillisecond;
  for (const DurationNs stall :
       {DurationNs{1}, 49 * kMillisecond, kTick, kTick + 1, 100 * kMillisecond, 130 * kMillisecond}) {
    PeriodicGrid grid(kSecond, kTick);
    const Release first = grid.next(kSecond);
    const TimeNs now_ns = first.due_at_ns + stall;
    EXPECT_EQ(next_due(first.due_at_ns, kTick, now_ns), grid.next(now_ns).due_at_ns) << stall;
  }
}

TEST(PeriodicGrid, NoDriftAfterAYearOfTicks) {
  PeriodicGrid grid(kStart, kPeriod);
  constexpr std::uint64_t kYear = 20ull * 3600 * 24 * 365;
  EXPECT_EQ(grid.next(kStart + static_cast<DurationNs>(kYear) * kPeriod).index, kYear);
  EXPECT_EQ(grid.due(kYear), kStart + static_cast<DurationNs>(kYear) * kPeriod);
}

TEST(PeriodicGrid, CatchUpServesAStallOf130MillisecondsInTurnAndSkipsNone) {
  const auto releases = run_with_stall(PeriodicGrid(kStart, kPeriod, OverrunPolicy::kCatchUp));
  for (std::size_t i = 0; i < releases.size(); ++i) {
    EXPECT_EQ(releases[i].index, i);
    EXPECT_EQ(releases[i].skipped, 0u);
    EXPECT_EQ(releases[i].due_at_ns, kStart + static_cast<DurationNs>(i) * kPeriod);
  }
}

TEST(PeriodicGrid, CatchUpServesTheYoungestOfALongStallAndSkipsTheRest) {
  PeriodicGrid grid(kStart, kPeriod, OverrunPolicy::kCatchUp);
  grid.next(kStart);
  const TimeNs after = kStart + 10 * kPeriod + kMillisecond;  // releases 1 ... 10 are overdue
  EXPECT_EQ(grid.next(after).skipped, 10 - PeriodicGrid::kCatchUpBurst);
  for (std::uint64_t k = 8; k <= 10; ++k) EXPECT_EQ(grid.next(after).index, k);
  EXPECT_EQ(grid.next(after).index, 11u);
}

TEST(PeriodicGrid, CatchUpOfAThreadThatIsAlwaysLateIsBounded) {
  PeriodicGrid grid(kStart, kPeriod, OverrunPolicy::kCatchUp);
  TimeNs now_ns = kStart;
  std::uint64_t late_in_a_row = 0, skipped = 0;
  for (int i = 0; i < 100; ++i) {
    const Release r = grid.next(now_ns);
    late_in_a_row = r.due_at_ns < now_ns ? late_in_a_row + 1 : 0;
    EXPECT_LE(late_in_a_row, PeriodicGrid::kCatchUpBurst);
    skipped += r.skipped;
    EXPECT_EQ(r.index, static_cast<std::uint64_t>(i) + skipped);
    now_ns = std::max(now_ns, r.due_at_ns) + 3 * kPeriod / 2;  // every release takes one and a half periods
  }
  EXPECT_GT(skipped, 0u);
}

TEST(PeriodicGrid, StopKeepsTheGridOfSkip) {
  EXPECT_TRUE(keeps_the_grid(run_with_stall(PeriodicGrid(kStart, kPeriod, OverrunPolicy::kStop))));
}

TEST(WaitNext, LatencyIsCountedFromTheIntendedRelease) {
  const TimeNs start = now() + 2 * kMillisecond;
  PeriodicGrid grid(start, kMillisecond);
  std::uint64_t served_or_skipped = 0;
  for (int i = 0; i < 20; ++i) {
    const Release release = wait_next(grid);
    served_or_skipped += 1 + release.skipped;
    EXPECT_GE(release.released_at_ns, release.due_at_ns);  // never early
    EXPECT_EQ(release.due_at_ns, start + static_cast<DurationNs>(release.index) * kMillisecond);
    EXPECT_EQ(release.index + 1, served_or_skipped);
  }
}

TEST(Clock, SleepUntilThePastOrNeverReturns) {
  sleep_until(now() - kSecond);
  sleep_until(0);
  sleep_until(kNever);  // a negative instant is EINVAL to the kernel, and must not be asked for again for ever
}

}  // namespace
}  // namespace wasp::rt
