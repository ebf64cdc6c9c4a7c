// The child as its guardian starts it: it waits to be told, has its descriptors, and does not outlive its holder.
#include "scheduling/flight_child.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include "scheduling/guard_page.h"
#include "tests/support/child.h"

namespace wasp::scheduling {
namespace {

cpu_set_t anywhere() {
  cpu_set_t cores;
  sched_getaffinity(0, sizeof cores, &cores);
  return cores;
}

/// Ends with 3 once it is told to go, with 4 when that cannot come any more.
std::vector<std::string> waits() { return {"/bin/sh", "-c", "[ \"$(head -c 1 <&6)\" = g ] && exit 3; exit 4"}; }

TEST(FlightChild, WaitsUntilItIsToldToGo) {
  const GuardPage page = GuardPage::create();
  FlightChild child(waits(), page.fd(), STDERR_FILENO, anywhere(), false);
  usleep(50'000);
  EXPECT_FALSE(child.poll()) << "it waits";
  child.go();
  ASSERT_TRUE(test::eventually([&] { return child.poll().has_value(); }));
  EXPECT_EQ(child.poll()->code, 3);
  child.go();  // once more: nothing
}

TEST(FlightChild, FindsPageAndLine) {
  const GuardPage page = GuardPage::create();
  FlightChild child(
      {"/bin/sh", "-c",
       "[ -e /proc/self/fd/4 ] && [ -S /proc/self/fd/5 ] && readlink /proc/self/fd/3 | grep -q wasp-guard"},
      page.fd(), STDERR_FILENO, anywhere(), false);
  ASSERT_TRUE(test::eventually([&] { return child.poll().has_value(); }));
  EXPECT_EQ(child.poll()->code, 0);
}

TEST(FlightChild, DiesWithWhoHoldsIt) {
  const GuardPage page = GuardPage::create();
  pid_t pid = 0;
  {
    const FlightChild child(waits(), page.fd(), STDERR_FILENO, anywhere(), false);
    pid = child.pid();
    EXPECT_EQ(kill(pid, 0), 0);
  }
  EXPECT_EQ(kill(pid, 0), -1) << "ended and reaped";
}

TEST(WaitForGo, IsTrueForTheWordAndFalseForItsEnd) {
  for (const bool told : {true, false}) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    if (told) {
      ASSERT_EQ(write(ends[1], "g", 1), 1);
    }
    close(ends[1]);
    EXPECT_EQ(wait_for_go(ends[0]), told);
  }
}

}  // namespace
}  // namespace wasp::scheduling
