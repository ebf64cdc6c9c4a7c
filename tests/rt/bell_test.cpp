// Waiting at several bells at once: woken by whichever rings, never missing a ring that came before the sleep.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

#include "rt/futex.h"

namespace wasp::rt {
namespace {

TEST(BellWaitAny, GivesUpAtItsDeadlineAndNotBefore) {
  Bell a, b;
  const std::array<Bell*, 2> bells = {&a, &b};
  const TimeNs deadline_ns = now() + 20 * kMillisecond;
  EXPECT_FALSE(Bell::wait_any(
      bells, []() noexcept { return false; }, deadline_ns));
  EXPECT_GE(now(), deadline_ns);
  EXPECT_FALSE(Bell::wait_any(
      {}, []() noexcept { return false; }, now() + kMillisecond));  // no bell: looks now and then
}

TEST(BellWaitAny, EveryRingOfEitherBellIsAnswered) {
  Bell a, b;
  const std::array<Bell*, 2> bells = {&a, &b};
  std::atomic<int> asked{0}, answered{0};
  std::thread sleeper([&] {
    for (int n = 1; n <= 2000; ++n) {
      if (!Bell::wait_any(
              bells, [&]() noexcept { return asked.load() >= n; }, now() + 60 * kSecond))
        return;
      answered.store(n);
    }
  });
  const TimeNs limit_ns = now() + 120 * kSecond;
  for (int n = 1; n <= 2000; ++n) {
    asked.store(n);
    (n % 2 == 0 ? a : b).ring();
    while (answered.load() < n && now() < limit_ns) std::this_thread::yield();
  }
  EXPECT_EQ(answered.load(), 2000);
  sleeper.join();
}

}  // namespace
}  // namespace wasp::rt
