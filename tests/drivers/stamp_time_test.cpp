#include "drivers/stamp_time.h"

#include <gtest/gtest.h>

namespace wasp::drivers {
namespace {

constexpr double kTicks_per_s = 60e6;
constexpr std::uint32_t kFrame = 2'000'000;
constexpr DurationNs kPeriod = 33'333'333;

TEST(StampTime, DelaysOnTheWayShiftNothing) {
  StampTime time(kTicks_per_s);
  std::uint32_t ticks = UINT32_MAX - 3 * kFrame;  // wraps on the way
  TimeNs last_ns = time.at(ticks, kSecond);
  for (int i = 1; i < 20; ++i) {
    const TimeNs arrived_ns = kSecond + i * kPeriod + (i % 3) * 200 * kMillisecond;
    const TimeNs at_ns = time.at(ticks += kFrame, arrived_ns);
    EXPECT_NEAR(static_cast<double>(at_ns - last_ns), static_cast<double>(kPeriod), 1.0) << i;
    last_ns = at_ns;
  }
}

TEST(StampTime, AStampOfTheOtherStreamMayBeALittleOlder) {
  StampTime time(kTicks_per_s);
  const TimeNs depth_ns = time.at(10'000'000, kSecond);
  EXPECT_EQ(depth_ns - time.at(10'000'000 - 600'000, kSecond + kMillisecond), 10 * kMillisecond);
}

TEST(StampTime, AJumpAndAMissedWrapCountByArrival) {
  StampTime time(kTicks_per_s);
  const TimeNs first_ns = time.at(5, kSecond);
  EXPECT_EQ(time.at(5 + 700'000'000, 2 * kSecond) - first_ns, kSecond) << "11.7 s ahead in one";
  EXPECT_EQ(time.at(5 + 700'000'000 + kFrame, 2 * kSecond + kPeriod) - first_ns, kSecond + kPeriod);
  const TimeNs later_ns = time.at(77, 202 * kSecond + kPeriod);
  EXPECT_EQ(later_ns - first_ns, 201 * kSecond + kPeriod) << "two wraps of silence";
}

}  // namespace
}  // namespace wasp::drivers
