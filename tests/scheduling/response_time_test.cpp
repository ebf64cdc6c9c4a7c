// Response times against published examples, and against schedules played tick by tick: no schedule may ever exceed R.
#include "scheduling/response_time.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "scheduling/schedule_picture.h"

namespace wasp::scheduling {
namespace {

AnalysedThread thread(int priority, DurationNs cost, DurationNs period, DurationNs deadline = 0) {
  AnalysedThread t;
  t.name = std::to_string(priority);
  t.priority = priority;
  t.cost_ns = cost;
  t.period_ns = period;
  t.deadline_ns = deadline > 0 ? deadline : period;
  return t;
}

std::vector<DurationNs> responses(const std::vector<AnalysedThread>& threads) {
  std::vector<DurationNs> list;
  for (const auto& r : response_times(threads)) list.push_back(r.response_ns);
  return list;
}

// Burns and Wellings, Real-Time Systems and Programming Languages, the worked example of the recurrence of Joseph and
// Pandya (The Computer Journal 29, 1986): C/T = 3/7, 3/12, 5/20.
TEST(ResponseTime, TheTextbooksExample) {
  EXPECT_EQ(responses({thread(3, 3, 7), thread(2, 3, 12), thread(1, 5, 20)}), (std::vector<DurationNs>{3, 6, 20}));
}

// The same book, harmonic periods at full utilisation: C/T = 40/80, 10/40, 5/20 under rate-monotonic priorities.
TEST(ResponseTime, HarmonicPeriodsUseTheWholeCore) {
  const std::vector<AnalysedThread> set{thread(1, 40, 80), thread(2, 10, 40), thread(3, 5, 20)};
  EXPECT_EQ(responses(set), (std::vector<DurationNs>{80, 15, 5}));
  EXPECT_DOUBLE_EQ(utilisation(set, 0), 1.0);
}

// ... and C/T = 12/50, 10/40, 10/30, which fails the utilisation bound and misses: the lowest needs 52 of its 50.
TEST(ResponseTime, TheOneThatMisses) {
  const auto r = response_times({thread(1, 12, 50), thread(2, 10, 40), thread(3, 10, 30)});
  EXPECT_FALSE(r[0].meets_deadline);
  EXPECT_FALSE(r[0].bounded);
  EXPECT_GT(r[0].response_ns, 50);
  EXPECT_TRUE(r[1].meets_deadline && r[2].meets_deadline);
  EXPECT_EQ(r[0].delayed_by, (std::vector<std::size_t>{1, 2}));
}

// Audsley et al., Software Engineering Journal 8 (1993): jitter of a higher thread brings its releases closer together.
TEST(ResponseTime, JitterAndBlockingAreAdded) {
  auto high = thread(2, 2, 10), low = thread(1, 4, 30);
  EXPECT_EQ(responses({high, low})[1], 6);
  high.jitter_ns = 5;  // a second release 5 after the first
  EXPECT_EQ(responses({high, low})[1], 8);
  low.blocking_ns = 1;
  low.jitter_ns = 3;
  EXPECT_EQ(responses({high, low})[1], 8 + 1 + 3);
}

TEST(ResponseTime, EqualPrioritiesDelayEachOtherAndOtherCoresDoNot) {
  auto a = thread(5, 3, 20), b = thread(5, 4, 20), elsewhere = thread(9, 10, 20);
  elsewhere.core = 1;
  EXPECT_EQ(responses({a, b, elsewhere}), (std::vector<DurationNs>{7, 7, 10}));
  elsewhere.core = -1;  // it may run here too
  EXPECT_EQ(responses({a, b, elsewhere})[0], 17);
}

TEST(ResponseTime, ADeadlineBeforeThePeriodIsHeldAgainstR) {
  const auto r = response_times({thread(2, 3, 20), thread(1, 3, 20, 5)});
  EXPECT_TRUE(r[0].meets_deadline);
  EXPECT_FALSE(r[1].meets_deadline);
}

/// One time unit at a time, releases at `offset + k * period` (at least: sporadic threads come later at random), equal
/// priorities first come first served: the longest response of each thread.
std::vector<DurationNs> longest_played(const std::vector<AnalysedThread>& threads, std::mt19937& random, int length) {
  struct Job {
    std::size_t thread;
    int released;
    DurationNs left;
  };
  std::vector<Job> jobs;
  std::vector<int> due;
  for (const auto& t : threads) due.push_back(static_cast<int>(random() % static_cast<unsigned>(t.period_ns)));
  std::vector<DurationNs> longest(threads.size(), 0);
  for (int now = 0; now < length; ++now) {
    for (std::size_t i = 0; i < threads.size(); ++i)
      if (due[i] == now) {
        jobs.push_back({i, now, threads[i].cost_ns});
        due[i] += static_cast<int>(threads[i].period_ns) + (random() % 4 == 0 ? static_cast<int>(random() % 7) : 0);
      }
    if (jobs.empty()) continue;
    const auto job = std::min_element(jobs.begin(), jobs.end(), [&](const Job& a, const Job& b) {
      const int pa = threads[a.thread].priority, pb = threads[b.thread].priority;
      return pa != pb ? pa > pb : a.released < b.released;
    });
    if (--job->left > 0) continue;
    longest[job->thread] = std::max<DurationNs>(longest[job->thread], now + 1 - job->released);
    jobs.erase(job);
  }
  return longest;
}

TEST(ResponseTime, NoPlayedScheduleOfRandomTablesExceedsIt) {
  std::mt19937 random(20261122);
  int bounded = 0, reached = 0;
  for (int set = 0; set < 300; ++set) {
    std::vector<AnalysedThread> threads;
    const int n = 2 + static_cast<int>(random() % 5);
    for (int i = 0; i < n; ++i) {
      const auto period = static_cast<DurationNs>(5 + random() % 60);
      threads.push_back(thread(1 + static_cast<int>(random() % 4), 1 + static_cast<DurationNs>(random() % 8), period));
    }
    const auto r = response_times(threads);
    for (int phase = 0; phase < 5; ++phase) {
      const auto played = longest_played(threads, random, 3000);
      for (std::size_t i = 0; i < threads.size(); ++i) {
        if (!r[i].bounded) continue;
        EXPECT_LE(played[i], r[i].response_ns) << "set " << set << " thread " << i;
        ++bounded;
        reached += played[i] == r[i].response_ns ? 1 : 0;
      }
    }
  }
  EXPECT_GT(bounded, 1000);
  EXPECT_GT(reached, 100);  // and the bound is no exaggeration
}

TEST(SchedulePicture, PlaysTheCriticalInstantOfTheTextbook) {
  const std::vector<AnalysedThread> set{thread(3, 3, 7), thread(2, 3, 12), thread(1, 5, 20)};
  const auto slices = play(set, 20);
  DurationNs last_end = 0, ran = 0;
  for (const auto& s : slices) {
    EXPECT_GE(s.start_ns, last_end);
    last_end = s.end_ns;
    if (s.thread == 2) ran += s.end_ns - s.start_ns;
  }
  EXPECT_EQ(ran, 5);
  EXPECT_EQ(last_end, 20);  // R of the lowest
  const std::string picture = schedule_picture(set, 20, 20);
  EXPECT_NE(picture.find("###....###....###..."), std::string::npos) << picture;
  EXPECT_NE(picture.find("---###......##---#.."), std::string::npos) << picture;
}

}  // namespace
}  // namespace wasp::scheduling
