// What ran instead: the kernel's trace as text, and, where tracefs can be mounted, the kernel's own word.
#include "scheduling/switch_trace.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "rt/clock.h"
#include "rt/thread.h"
#include "tests/support/child.h"

namespace wasp::scheduling {
namespace {

constexpr const char* kText = R"(# tracer: nop
#
# entries-in-buffer/entries-written: 4/4   #P:2
#
#           TASK-PID     CPU#  |||||  TIMESTAMP  FUNCTION
          <idle>-0       [001] d..2.   100.000100: sched_switch: prev_comm=swapper/1 prev_pid=0 prev_prio=120 prev_state=R ==> next_comm=a b [c] next_pid=77 next_prio=49
           a b [c]-77    [001] d.h1.   100.000200: irq_handler_entry: irq=24 name=virtio0-input.0
           a b [c]-77    [001] ..s1.   100.000210: softirq_entry: vec=1 [action=TIMER]
           a b [c]-77    [000] d..2.   100.000300: sched_switch: prev_comm=x prev_pid=5 prev_prio=120 prev_state=S ==> next_comm=other core next_pid=6 next_prio=120
CPU:1 [LOST 12 EVENTS]
           a b [c]-77    [001] d..2.   100.001100: sched_switch: prev_comm=a b [c] prev_pid=77 prev_prio=9 prev_state=R+ ==> next_comm=control next_pid=12 next_prio=19
)";

TEST(SwitchTrace, ReadsSwitchesAndInterruptsAndPassesOverTheRest) {
  const auto events = parse_trace(kText);
  ASSERT_EQ(events.size(), 5u);
  EXPECT_EQ(events[0].at_ns, 100 * kSecond + 100 * kMicrosecond);
  EXPECT_EQ(events[0].core, 1);
  EXPECT_EQ(events[0].task, "a b [c]");
  EXPECT_EQ(events[0].pid, 77);
  EXPECT_EQ(events[0].priority, 49);
  EXPECT_TRUE(events[1].interrupt);
  EXPECT_EQ(events[1].task, "irq 24 virtio0-input.0");
  EXPECT_EQ(events[2].task, "softirq TIMER");
  EXPECT_EQ(events[3].core, 0);
  EXPECT_TRUE(parse_trace("").empty());
  EXPECT_TRUE(parse_trace(": sched_switch: ==> next_comm= next_pid=\nirq: [: sched_switch: \n").empty());
}

TEST(SwitchTrace, SharesAreOfOneCoreAndOneWindow) {
  const TimeNs t0 = 100 * kSecond;
  const auto shares = shares_of(parse_trace(kText), 1, t0 + 600 * kMicrosecond, t0 + 1300 * kMicrosecond);
  ASSERT_EQ(shares.size(), 2u);
  EXPECT_EQ(shares[0].name, "a b [c]");
  EXPECT_EQ(shares[0].ran_ns, 500 * kMicrosecond);
  EXPECT_EQ(shares[0].priority, 9);  // as it left: it made itself more urgent while it ran
  EXPECT_EQ(shares[1].name, "control");
  EXPECT_EQ(shares[1].ran_ns, 200 * kMicrosecond);
  const auto all = shares_of(parse_trace(kText), 1, t0, t0 + kSecond);
  EXPECT_EQ(all.size(), 4u);
  EXPECT_EQ(all[2].interrupts, 1u);
}

TEST(SwitchTrace, SaysWhyWhereThereIsNone) {
  const SwitchTrace none("/nowhere", 0);
  EXPECT_FALSE(none.available());
  EXPECT_NE(none.why_not().find("tracefs"), std::string::npos);
  EXPECT_FALSE(SwitchTrace("", -1).available());
}

constexpr int kNotPermitted = 77;

/// In a child with a mount namespace of its own: traces core 0 while a named thread spins there.
int trace_a_spinner() {
  if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return kNotPermitted;
  std::string folder = "/tmp/wasp_tracefs_XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) return kNotPermitted;
  int result = kNotPermitted;
  if (mount("nodev", folder.c_str(), "tracefs", 0, nullptr) == 0) {
    const int core = rt::nearest_usable_core(0);
    SwitchTrace trace(folder, core);
    if (!trace.available()) std::fprintf(stderr, "%s\n", trace.why_not().c_str());
    const TimeNs from_ns = rt::now();
    {
      rt::ThreadSpec spec;
      spec.name = "spinner-of-test";
      spec.core = core;
      rt::Thread spinner(spec, [] {
        for (const TimeNs until = rt::now() + 100 * kMillisecond; rt::now() < until;) {
        }
      });
    }
    result = 1;
    for (const auto& s : shares_of(trace.take(), core, from_ns, rt::now()))
      if (s.name == "spinner-of-test" && s.ran_ns > 0 && s.pid > 0) result = 0;
  }
  umount(folder.c_str());  // the trace's instance is gone by now
  rmdir(folder.c_str());
  return result;
}

TEST(SwitchTrace, TheKernelNamesWhatRanOnTheCore) {
  const int status = test::wait_for(test::start_child(trace_a_spinner));
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == kNotPermitted) GTEST_SKIP() << "tracefs cannot be mounted here";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace wasp::scheduling
