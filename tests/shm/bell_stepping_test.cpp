// The bell at every pair of instants: a ringer stops after each instruction of a ring, a sleeper after each of its way
// to sleep (in the short form: each of the last, and some before), then the ringer goes on, then the sleeper. The next
// ring must wake it. What made this test: a sleeper that arrived behind the changed word but before the ringer counted
// arrivals was taken for woken, and lay down for good (found by tests/models/bell.pml).
#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

#include "rt/clock.h"
#include "tests/shm/fixture.h"
#include "tests/support/traced.h"

namespace wasp::shm {
namespace {

/// Between ringer, sleeper and test.
struct Line {
  rt::Bell bell;
  std::atomic<std::uint64_t> number{0}, heard{0};

  void publish(std::uint64_t n) {
    number.store(n, std::memory_order_release);
    bell.ring();
  }
  /// Sleeps for each number up to `last`; gives up when it was the deadline that ended the sleep.
  void hear(std::uint64_t last) {
    for (std::uint64_t seen = 0; seen < last; heard = seen) {
      const TimeNs deadline = rt::now() + 60 * kSecond;
      bell.wait([&]() noexcept { return number.load(std::memory_order_acquire) > seen; }, deadline);
      if (rt::now() >= deadline) return;
      seen = number.load(std::memory_order_acquire);
    }
  }
};

/// So that no step is the dynamic linker's.
void rehearse() {
  Line line;
  static_cast<void>(rt::now());
  static_cast<void>(sched_getcpu());
  rt::futex_wake_all(&line.bell.word);
  line.publish(1);
  line.hear(1);
}

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr std::uint64_t kNear = 8, kRingerStride = 29;
#else
constexpr std::uint64_t kNear = 24, kRingerStride = 1;
#endif

class BellStepping : public testing::Test {
 protected:
  ~BellStepping() override { munmap(&line_, sizeof(Line)); }

  /// Stops the ringer after so many instructions, then the sleeper, lets both go on in turn, and rings once more.
  /// `sleeper_steps` becomes what the sleeper could take before it lies down.
  void try_pair(std::uint64_t ringer_steps, std::uint64_t& sleeper_steps) {
    new (&line_) Line;
    test::Traced ringer([] { return 0; }, [&](int) { line_.publish(1); });
    if (!ringer.permitted()) GTEST_SKIP() << "ptrace is not permitted here";
    ringer.step_instructions(ringer_steps);
    const long call = ringer.next_system_call();
    ringer_through_ = ringer.finished() || (call >= 0 && call != SYS_futex);  // on its way out
    test::Traced sleeper([] { return 0; }, [&](int) { line_.hear(2); });
    std::uint64_t taken = 0;
    for (; taken < sleeper_steps && sleeper.next_system_call() != SYS_futex; ++taken) sleeper.step_instructions(1);
    ringer.run_to_the_end();
    ASSERT_TRUE(sleeper.run_until_asleep());
    line_.publish(2);
    sleeper.run_to_the_end();
    ASSERT_EQ(line_.heard.load(), 2u) << "ringer stopped after " << ringer_steps << ", sleeper after " << taken;
    sleeper_steps = taken;
    ++pairs_;
  }
  [[nodiscard]] bool ended() const { return HasFatalFailure() || IsSkipped(); }

  Line& line_ =
      *static_cast<Line*>(mmap(nullptr, sizeof(Line), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  bool ringer_through_ = false;
  int pairs_ = 0;
};

TEST_F(BellStepping, NoPairOfInstantsLosesAWakeUp) {
#if !defined(__x86_64__)
  GTEST_SKIP() << "system call instructions are recognised on x86-64 only";
#endif
  const std::uint64_t far_stride = std::getenv("WASP_STEPPING") != nullptr ? 1 : 37;
  rehearse();
  for (std::uint64_t ringer_steps = 0; !ringer_through_; ringer_steps += kRingerStride) {
    std::uint64_t last = 100'000;
    try_pair(ringer_steps, last);
    for (std::uint64_t at = last; at > 0 && !ended();) {
      at -= std::min(at, last - at < kNear ? 1 : far_stride);
      std::uint64_t steps = at;
      try_pair(ringer_steps, steps);
    }
    if (ended()) return;
  }
  EXPECT_GT(pairs_, 100);
  std::printf("%d pairs of instants\n", pairs_);
  RecordProperty("pairs", std::to_string(pairs_));
}

}  // namespace
}  // namespace wasp::shm
