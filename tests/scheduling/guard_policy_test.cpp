// What the guardian decides, on virtual time.
#include "scheduling/guard_policy.h"

#include <gtest/gtest.h>

#include <vector>

namespace wasp::scheduling {
namespace {

/// A guardian that looks when it planned to, beside a control thread that beats on its grid until it is stopped.
struct Bench {
  GuardTimes times;
  GuardState state;
  TimeNs now_ns = 10 * kSecond, due_ns = 10 * kSecond;  ///< of the last release served
  TimeNs beat_at_ns = 10 * kSecond, silent_from_ns = kForever, silent_until_ns = kForever, dead_at_ns = kForever;
  bool commanding = true;
  std::vector<TimeNs> spoken, taken, given_back, killed;

  void beats() {
    while (due_ns + times.period_ns <= now_ns) {
      due_ns += times.period_ns;
      const bool hangs = due_ns >= silent_from_ns && due_ns < silent_until_ns;
      if (!hangs && due_ns < dead_at_ns) beat_at_ns = due_ns, served_ns = due_ns;
    }
  }
  void run_until(TimeNs end_ns, DurationNs late_ns = 0) {
    while (now_ns < end_ns) {
      beats();
      const GuardDeed deed = guard_step(
          times, {now_ns, late_ns, now_ns < dead_at_ns, commanding, beat_at_ns, served_ns + times.period_ns}, state);
      if (deed.take) taken.push_back(now_ns);
      if (deed.speak) spoken.push_back(now_ns);
      if (deed.give_back) given_back.push_back(now_ns);
      if (deed.kill) killed.push_back(now_ns);
      ASSERT_GT(deed.look_again_at_ns, now_ns);
      now_ns = std::min({deed.look_again_at_ns, end_ns, now_ns < dead_at_ns ? dead_at_ns : kForever});
    }
  }
  TimeNs served_ns = 10 * kSecond;
};

TEST(GuardPolicy, SaysNothingWhileControlBeats) {
  Bench b;
  b.run_until(b.now_ns + 10 * kSecond);
  EXPECT_TRUE(b.taken.empty());
  EXPECT_TRUE(b.spoken.empty());
  EXPECT_TRUE(b.killed.empty());
}

TEST(GuardPolicy, SpeaksWithinOneAndAHalfPeriodsWhereverInAPeriodControlHangs) {
  for (DurationNs phase_ns = 0; phase_ns < 50 * kMillisecond; phase_ns += kMillisecond) {
    Bench b;
    const TimeNs hang_ns = b.now_ns + kSecond + phase_ns;
    b.silent_from_ns = hang_ns;
    b.run_until(hang_ns + 75 * kMillisecond);
    ASSERT_FALSE(b.spoken.empty()) << phase_ns;
    EXPECT_LE(b.spoken.front(), hang_ns + 75 * kMillisecond);
    EXPECT_GE(b.spoken.front(), hang_ns);
  }
}

TEST(GuardPolicy, SpeaksAtOnceForADeadProcessThatCommanded) {
  Bench b;
  b.dead_at_ns = b.now_ns + kSecond + 7 * kMillisecond;
  b.run_until(b.dead_at_ns + kMillisecond);
  ASSERT_EQ(b.spoken.size(), 1u);
  EXPECT_EQ(b.spoken.front(), b.dead_at_ns);
}

TEST(GuardPolicy, SpeaksAtTheControlRateThenFallsSilentOnPurpose) {
  Bench b;
  b.dead_at_ns = b.now_ns + kSecond;
  b.run_until(b.dead_at_ns + 5 * kSecond);
  EXPECT_EQ(b.spoken.size(), 40u);  // 2 s at 20 Hz
  for (std::size_t i = 1; i < b.spoken.size(); ++i) EXPECT_EQ(b.spoken[i] - b.spoken[i - 1], 50 * kMillisecond);
  EXPECT_LT(b.spoken.back(), b.dead_at_ns + 2 * kSecond);
}

TEST(GuardPolicy, GivesTheLineBackToControlThatBeatsAgain) {
  Bench b;
  b.silent_from_ns = b.now_ns + kSecond;
  b.silent_until_ns = b.silent_from_ns + 120 * kMillisecond;
  b.run_until(b.now_ns + 3 * kSecond);
  ASSERT_EQ(b.taken.size(), 1u);
  ASSERT_EQ(b.given_back.size(), 1u);
  EXPECT_LE(b.given_back.front(), b.silent_until_ns + 55 * kMillisecond);
  EXPECT_TRUE(b.killed.empty());
  EXPECT_LT(b.spoken.back(), b.given_back.front());
}

TEST(GuardPolicy, KillsAProcessThatStaysSilentWhetherItCommandedOrNot) {
  for (const bool commanding : {true, false}) {
    Bench b;
    b.commanding = commanding;
    b.silent_from_ns = b.now_ns + kSecond;
    b.run_until(b.now_ns + 2 * kSecond);
    ASSERT_FALSE(b.killed.empty());
    EXPECT_LE(b.killed.front(), b.silent_from_ns + b.times.kill_after_ns + 100 * kMillisecond);
    EXPECT_EQ(b.spoken.empty(), !commanding);
  }
}

TEST(GuardPolicy, SaysNothingForAProcessThatDiedWithoutCommanding) {
  Bench b;
  b.commanding = false;
  b.dead_at_ns = b.now_ns + kSecond;
  b.run_until(b.now_ns + 3 * kSecond);
  EXPECT_TRUE(b.taken.empty());
}

TEST(GuardPolicy, WithoutNeutralTheStreamJustStops) {
  Bench b;
  b.times.neutral_ns = 0;
  b.dead_at_ns = b.now_ns + kSecond;
  b.run_until(b.now_ns + 3 * kSecond);
  EXPECT_EQ(b.taken.size(), 1u);
  EXPECT_TRUE(b.spoken.empty());
}

TEST(GuardPolicy, AHostThatHeldUpTheGuardianAsWellGivesControlOneMoreLook) {
  GuardTimes times;
  GuardState state;
  GuardSight sight{10 * kSecond, 40 * kMillisecond, true, true, 9'900 * kMillisecond, 9'950 * kMillisecond};
  const GuardDeed first = guard_step(times, sight, state);
  EXPECT_FALSE(first.take);
  EXPECT_LE(first.look_again_at_ns - sight.now_ns, 5 * kMillisecond);
  sight.now_ns = first.look_again_at_ns;
  EXPECT_TRUE(guard_step(times, sight, state).take);  // once, not for ever
}

TEST(GuardPolicy, ARestartedProcessGetsTheLineOnlyWhenNeutralIsOver) {
  Bench b;
  b.dead_at_ns = b.now_ns + kSecond;
  b.run_until(b.dead_at_ns + 100 * kMillisecond);
  b.state.restarted = true;
  b.commanding = false;
  b.dead_at_ns = kForever;
  b.run_until(b.now_ns + 5 * kSecond);
  EXPECT_EQ(b.spoken.size(), 40u);
  ASSERT_EQ(b.given_back.size(), 1u);
  EXPECT_GE(b.given_back.front(), b.taken.front() + 2 * kSecond);
}

}  // namespace
}  // namespace wasp::scheduling
