// A thread whose schedule is changed from outside: seen, said once, counted, taken back a few times.
#include "scheduling/schedule_watch.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <thread>

#include "rt/clock.h"
#include "rt/thread.h"

namespace wasp::scheduling {
namespace {

class ScheduleWatchTest : public ::testing::Test {
 protected:
  static constexpr int kPriority = 3;
  /// A sleeping thread on core 0; real time where that is allowed.
  ScheduleWatchTest() : row_{"control", rt::nearest_usable_core(0), kPriority, kMillisecond} {
    watch_ = &board_.add(row_);
    rt::ThreadSpec spec{.name = "stolen", .core = row_.core};
    try {
      thread_ =
          rt::Thread({.name = "stolen", .policy = rt::Policy::kFifo, .priority = kPriority, .core = row_.core}, body());
      real_time_ = true;
    } catch (const std::exception&) {
      thread_ = rt::Thread(spec, body());
    }
    while (watch_->tid.load() == 0) rt::sleep_until(rt::now() + kMillisecond);
  }
  ~ScheduleWatchTest() override {
    over_ = true;
    thread_.join();
  }
  std::function<void()> body() {
    return [this] {
      watch_->attach();
      while (!over_) rt::sleep_until(rt::now() + kMillisecond);
    };
  }
  void look(ScheduleWatch& w) {
    w.look(status_, [this](const std::string& line) { lines_.push_back(line); });
  }
  /// Moves the thread to other cores; false where there is no other.
  bool move_away() const {
    cpu_set_t all;
    sched_getaffinity(0, sizeof all, &all);
    return CPU_COUNT(&all) > 1 && sched_setaffinity(watch_->tid.load(), sizeof all, &all) == 0;
  }

  WatchBoard board_;
  WatchedThread row_;
  ThreadWatch* watch_;
  RunStatus status_;
  std::vector<std::string> lines_;
  bool real_time_ = false;
  std::atomic<bool> over_{false};
  rt::Thread thread_;
};

TEST_F(ScheduleWatchTest, AThreadAsTheTableSaysIsNoNews) {
  ScheduleWatch w(*watch_, real_time_);
  for (int i = 0; i < 3; ++i) look(w);
  EXPECT_TRUE(lines_.empty()) << lines_[0];
  EXPECT_EQ(watch_->stolen.load(), 0u);
}

TEST_F(ScheduleWatchTest, OtherCoresAreSaidCountedAndTakenBackAndNotForEver) {
  ScheduleWatch w(*watch_, real_time_);
  look(w);
  for (int i = 1; i <= ScheduleWatch::kTakeBacks + 1; ++i) {
    if (!move_away()) GTEST_SKIP() << "one core only";
    look(w);
    EXPECT_EQ(status_.schedule_thefts.load(), static_cast<std::uint64_t>(i));
    EXPECT_EQ(watch_->stolen.load(), 1u);
    ASSERT_EQ(lines_.size(), static_cast<std::size_t>(i));
    EXPECT_NE(lines_.back().find("on core 0 is now"), std::string::npos) << lines_.back();
    look(w);
    EXPECT_EQ(watch_->stolen.load(), i <= ScheduleWatch::kTakeBacks ? 0u : 1u);
  }
  EXPECT_NE(lines_[0].find("; taken back"), std::string::npos) << lines_[0];
  EXPECT_NE(lines_.back().find("not taken back any more"), std::string::npos) << lines_.back();
  for (int i = 0; i < 5; ++i) look(w);
  EXPECT_EQ(status_.schedule_thefts.load(), 4u);  // told once
}

TEST_F(ScheduleWatchTest, AStolenPriorityIsSaidByItsNumbers) {
  if (!real_time_) GTEST_SKIP() << "no right to SCHED_FIFO";
  ScheduleWatch w(*watch_, true);
  const sched_param ordinary{};
  ASSERT_EQ(sched_setscheduler(watch_->tid.load(), SCHED_OTHER, &ordinary), 0);
  look(w);
  ASSERT_EQ(lines_.size(), 1u);
  EXPECT_EQ(lines_[0], "control: SCHED_FIFO 3 on core 0 is now SCHED_OTHER on core 0; taken back");
  look(w);
  EXPECT_EQ(watch_->stolen.load(), 0u);
  EXPECT_EQ(schedule_of(watch_->tid.load())->priority, kPriority);
}

TEST_F(ScheduleWatchTest, ADemotedBehaviourIsWhereItBelongs) {
  ScheduleWatch w(*watch_, true);
  const sched_param ordinary{};
  ASSERT_EQ(sched_setscheduler(watch_->tid.load(), SCHED_OTHER, &ordinary), 0);
  watch_->demoted = 1;
  look(w);
  EXPECT_TRUE(lines_.empty());
}

TEST(Schedule, IsDescribedAsTaskToolsWriteIt) {
  Schedule s{SCHED_OTHER, 0, {}};
  for (const int core : {0, 1, 2, 5}) CPU_SET(core, &s.cores);
  EXPECT_EQ(describe(s), "SCHED_OTHER on cores 0-2,5");
}

}  // namespace
}  // namespace wasp::scheduling
