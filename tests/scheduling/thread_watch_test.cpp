// What a step under way shows to control: stale from the nanosecond on in which its budget is spent.
#include "scheduling/thread_watch.h"

#include <gtest/gtest.h>

namespace wasp::scheduling {
namespace {

TEST(ThreadWatch, AStepIsOverdueFromItsBudgetOnAndNoEarlier) {
  WatchBoard board;
  ThreadWatch& watch = board.add({"maker", -1, 50, 4 * kMillisecond, true});
  EXPECT_FALSE(watch.overdue(kSecond));  // no step under way
  watch.busy_since_ns = kSecond;
  EXPECT_FALSE(watch.overdue(kSecond + 4 * kMillisecond));
  EXPECT_TRUE(watch.overdue(kSecond + 4 * kMillisecond + 1));
  EXPECT_TRUE(watch.overdue(3600 * kSecond));  // a step without end
  watch.busy_since_ns = 0;
  EXPECT_FALSE(watch.overdue(3600 * kSecond));
}

}  // namespace
}  // namespace wasp::scheduling
