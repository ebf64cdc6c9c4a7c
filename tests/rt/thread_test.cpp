// What the kernel says of a thread must be what its spec asked for; where a right is missing, the error names it.
#include "rt/thread.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <string>
#include <system_error>

#include "rt/clock.h"
#include "tests/support/child.h"

namespace wasp::rt {
namespace {

struct Seen {
  std::string name;
  int policy = -1, priority = -1, core = -1, cores = 0;
};

Seen look_around() {
  Seen seen;
  char name[16] = {};
  pthread_getname_np(pthread_self(), name, sizeof name);
  seen.name = name;
  seen.policy = static_cast<int>(syscall(SYS_sched_getscheduler, 0));
  sched_param param{};
  sched_getparam(0, &param);
  seen.priority = param.sched_priority;
  cpu_set_t set;
  sched_getaffinity(0, sizeof set, &set);
  seen.cores = CPU_COUNT(&set);
  seen.core = sched_getcpu();
  return seen;
}

Seen run_with(const ThreadSpec& spec) {
  Seen seen;
  Thread(spec, [&] { seen = look_around(); }).join();
  return seen;
}

bool fifo_allowed() {
  try {
    Thread({.name = "probe", .policy = Policy::kFifo, .priority = 1}, [] {});
    return true;
  } catch (const std::system_error&) {
    return false;
  }
}

/// In a child without privileges: the text of the error a spec meets, written to a pipe. Empty if there was none.
std::string error_as_plain_user(const ThreadSpec& spec) {
  int ends[2];
  if (pipe(ends) != 0) return "no pipe";
  const pid_t child = test::start_child([&] {
    const rlimit none{0, 0};
    setrlimit(RLIMIT_RTPRIO, &none);
    if (getuid() == 0 && setresuid(65534, 65534, 65534) != 0) return 2;
    try {
      Thread(spec, [] {});
    } catch (const std::system_error& e) {
      const std::string what = e.what();
      return write(ends[1], what.data(), what.size()) > 0 ? 0 : 3;
    }
    return 0;
  });
  close(ends[1]);
  std::string text(4096, '\0');
  const auto n = read(ends[0], text.data(), text.size());
  close(ends[0]);
  EXPECT_EQ(test::wait_for(child), 0);
  text.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  return text;
}

TEST(Thread, HasItsName) {
  EXPECT_EQ(run_with({.name = "ground_altitude"}).name, "ground_altitude");
  EXPECT_EQ(run_with({.name = "a_name_that_is_too_long"}).name, "a_name_that_is_");
}

TEST(Thread, RunsOnItsCoreAlone) {
  const int core = nearest_usable_core(1000);
  const Seen seen = run_with({.name = "pinned", .core = core});
  EXPECT_EQ(seen.core, core);
  EXPECT_EQ(seen.cores, 1);
  EXPECT_EQ(nearest_usable_core(core), core);
  EXPECT_GE(usable_cores(), 1);
}

TEST(Thread, HasItsPriority) {
  if (!fifo_allowed()) GTEST_SKIP() << "SCHED_FIFO is not permitted here";
  const Seen seen = run_with({.name = "control", .policy = Policy::kFifo, .priority = 42});
  EXPECT_EQ(seen.policy, SCHED_FIFO);
  EXPECT_EQ(seen.priority, 42);
}

TEST(Thread, OrdinaryMeansOrdinaryEvenWhenItsCreatorIsRealTime) {
  if (!fifo_allowed()) GTEST_SKIP() << "SCHED_FIFO is not permitted here";
  Seen seen;
  Thread({.name = "creator", .policy = Policy::kFifo, .priority = 10}, [&] {
    seen = run_with({.name = "logger"});
  }).join();
  EXPECT_EQ(seen.policy, SCHED_OTHER);
}

TEST(Thread, MissingRightIsNamedWithItsRemedy) {
  const std::string what = error_as_plain_user({.name = "control", .policy = Policy::kFifo, .priority = 80});
  EXPECT_NE(what.find("'control'"), std::string::npos) << what;
  EXPECT_NE(what.find("SCHED_FIFO priority 80"), std::string::npos) << what;
  EXPECT_NE(what.find("CAP_SYS_NICE"), std::string::npos) << what;
  EXPECT_NE(what.find("rtprio"), std::string::npos) << what;
}

TEST(Thread, RefusedDeadlinePolicyIsAnErrorNotASilentDowngrade) {
  const std::string what = error_as_plain_user({.name = "control",
                                                .policy = Policy::kDeadline,
                                                .runtime_ns = kMillisecond,
                                                .deadline_ns = 10 * kMillisecond,
                                                .period_ns = 10 * kMillisecond});
  EXPECT_NE(what.find("'control'"), std::string::npos) << what;
  EXPECT_NE(what.find("SCHED_DEADLINE"), std::string::npos) << what;
  EXPECT_NE(what.find("CAP_SYS_NICE"), std::string::npos) << what;
}

TEST(Thread, DeadlinePolicyIsInForceWhenTheBodyRuns) {
  constexpr int kSchedDeadline = 6;
  try {
    const Seen seen = run_with({.name = "control",
                                .policy = Policy::kDeadline,
                                .runtime_ns = kMillisecond,
                                .deadline_ns = 10 * kMillisecond,
                                .period_ns = 10 * kMillisecond});
    EXPECT_EQ(seen.policy, kSchedDeadline);
  } catch (const std::system_error& e) {
    GTEST_SKIP() << e.what();
  }
}

TEST(Thread, ImpossibleCoreAndStackAreErrorsThatNameThem) {
  try {
    Thread({.name = "lost", .core = 1000}, [] {});
    FAIL() << "core 1000 was accepted";
  } catch (const std::system_error& e) {
    EXPECT_NE(std::string(e.what()).find("core 1000"), std::string::npos) << e.what();
  }
  EXPECT_THROW(Thread({.name = "flat", .stack_bytes = 100}, [] {}), std::system_error);
  EXPECT_THROW(Thread({.name = "odd", .policy = Policy::kFifo, .priority = 1000}, [] {}), std::system_error);
}

TEST(Thread, StackIsPrefaultedBeforeTheBodyRuns) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizers' shadow memory faults too, and their frames are larger";
#endif
  long faults = -1;
  Thread({.name = "deep"}, [&] {
    rusage before{}, after{};
    getrusage(RUSAGE_THREAD, &before);
    volatile char frame[384 * 1024];
    for (std::size_t i = 0; i < sizeof frame; i += 4096) frame[i] = 1;
    getrusage(RUSAGE_THREAD, &after);
    faults = after.ru_minflt - before.ru_minflt;
  }).join();
  EXPECT_LE(faults, 2);  // 96 pages touched, of a stack of 512 KiB
}

TEST(Thread, MovesAndJoins) {
  std::atomic<int> ran{0};
  Thread a({.name = "a"}, [&] { ++ran; });
  Thread b = std::move(a);
  EXPECT_FALSE(a.joinable());
  EXPECT_TRUE(b.joinable());
  b = Thread({.name = "b"}, [&] { ++ran; });  // joins the first
  b.join();
  EXPECT_FALSE(b.joinable());
  EXPECT_EQ(ran.load(), 2);
}

}  // namespace
}  // namespace wasp::rt
