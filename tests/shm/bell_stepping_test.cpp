// The bell at every pair of instants: a ringer stops after each instruction of a ring, a sleeper after each (in the
// short form: each seventh) of its way to sleep, then the ringer goes on, then the sleeper. The next ring must wake it.
// What made this test: a sleeper that arrived behind the changed word but before the ringer counted arrivals was taken
// for woken, and lay down for good (found by tests/models/bell.pml).
#include <sys/mman.h>

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

TEST(BellStepping, NoPairOfInstantsLosesAWakeUp) {
#if !defined(__x86_64__)
  GTEST_SKIP() << "system call instructions are recognised on x86-64 only";
#elif defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  constexpr std::uint64_t kStride = 97;
#else
  const std::uint64_t kStride = std::getenv("WASP_STEPPING") != nullptr ? 1 : 7;
#endif
  Line& line =
      *static_cast<Line*>(mmap(nullptr, sizeof(Line), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  rehearse();
  int pairs = 0;
  bool ringer_through = false;
  for (std::uint64_t ringer_steps = 0; !ringer_through; ++ringer_steps) {
    bool sleeper_through = false;
    for (std::uint64_t sleeper_steps = 0; !sleeper_through; sleeper_steps += kStride, ++pairs) {
      new (&line) Line;
      test::Traced ringer([] { return 0; }, [&](int) { line.publish(1); });
      if (!ringer.permitted()) GTEST_SKIP() << "ptrace is not permitted here";
      ringer.step_instructions(ringer_steps);
      ringer_through = ringer.finished();
      test::Traced sleeper([] { return 0; }, [&](int) { line.hear(2); });
      for (std::uint64_t i = 0; i < sleeper_steps && !sleeper_through; ++i) {
        sleeper_through = sleeper.at_system_call();
        if (!sleeper_through) sleeper.step_instructions(1);
      }
      ringer.run_to_the_end();
      ASSERT_TRUE(sleeper.run_until_asleep());
      line.publish(2);
      sleeper.run_to_the_end();
      ASSERT_EQ(line.heard.load(), 2u) << "ringer stopped after " << ringer_steps << ", sleeper after "
                                       << sleeper_steps;
    }
  }
  EXPECT_GT(pairs, 100);
  std::printf("%d pairs of instants\n", pairs);
  RecordProperty("pairs", std::to_string(pairs));
  munmap(&line, sizeof(Line));
}

}  // namespace
}  // namespace wasp::shm
