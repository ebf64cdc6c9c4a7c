// Missing rights are found and named without changing anything that lasts; locking memory locks it.
#include "rt/process.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "tests/support/child.h"

// The sanitizers turn mlockall into nothing, and their allocators take no advice.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SKIP_UNDER_SANITIZERS() GTEST_SKIP() << "the sanitizers take mlockall and malloc for themselves"
#else
#define SKIP_UNDER_SANITIZERS() static_cast<void>(0)
#endif

namespace wasp::rt {
namespace {

/// "VmLck" of this process [kB].
long locked_kb() {
  std::ifstream file("/proc/self/status");
  std::string word;
  while (file >> word)
    if (word == "VmLck:") {
      long kb = 0;
      file >> kb;
      return kb;
    }
  return -1;
}

bool named(const std::vector<MissingRight>& missing, const std::string& right, const std::string& remedy) {
  for (const auto& m : missing)
    if (m.right.find(right) != std::string::npos && m.remedy.find(remedy) != std::string::npos) return true;
  return false;
}

/// Gives up root and its limits, in a child.
bool become_plain() {
  const rlimit none{0, 0}, little{64 * 1024, 64 * 1024};
  setrlimit(RLIMIT_RTPRIO, &none);
  setrlimit(RLIMIT_MEMLOCK, &little);
  return getuid() != 0 || setresuid(65534, 65534, 65534) == 0;
}

TEST(MissingRights, PlainUserIsToldBothAndHow) {
  const pid_t child = test::start_child([] {
    if (!become_plain()) return 2;
    const auto missing = missing_rights(80);
    if (!named(missing, "SCHED_FIFO priority 80", "setcap")) return 3;
    if (!named(missing, "locked memory", "ulimit -l")) return 4;
    return missing.size() == 2 ? 0 : 5;
  });
  EXPECT_EQ(test::wait_for(child), 0);
}

TEST(MissingRights, LimitsAloneAreEnough) {
  const pid_t child = test::start_child([] {
    const rlimit priority{90, 90}, memory{RLIM_INFINITY, RLIM_INFINITY};
    if (setrlimit(RLIMIT_RTPRIO, &priority) != 0 || setrlimit(RLIMIT_MEMLOCK, &memory) != 0) return 77;
    if (getuid() == 0 && setresuid(65534, 65534, 65534) != 0) return 2;
    return missing_rights(80).empty() ? 0 : 3;
  });
  const int status = test::wait_for(child);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "limits cannot be raised here";
  EXPECT_EQ(status, 0);
}

TEST(MissingRights, ALimitTooSmallForThisProcessIsFoundBeforeTheLockFails) {
  const pid_t child = test::start_child([] {
    const rlimit memory{80 << 20, 80 << 20};  // above the room asked for, below room and what is mapped already
    if (setrlimit(RLIMIT_MEMLOCK, &memory) != 0) return 77;
    if (getuid() == 0 && setresuid(65534, 65534, 65534) != 0) return 2;
    if (mmap(nullptr, 100 << 20, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == MAP_FAILED) return 77;
    return named(missing_rights(0), "locked memory", "ulimit") ? 0 : 3;
  });
  const int status = test::wait_for(child);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "limits cannot be raised here";
  EXPECT_EQ(status, 0);
}

TEST(MissingRights, AskingChangesNothingThatLasts) {
  SKIP_UNDER_SANITIZERS();
  const pid_t child = test::start_child([] {
    if (!lock_memory(1 << 20).empty()) return 77;
    const long before_kb = locked_kb();
    const int policy = sched_getscheduler(0);
    missing_rights(80);
    if (sched_getscheduler(0) != policy) return 3;
    return before_kb > 0 && locked_kb() >= before_kb ? 0 : 4;  // asking must not unlock what was locked
  });
  const int status = test::wait_for(child);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "memory cannot be locked here";
  EXPECT_EQ(status, 0);
}

TEST(LockMemory, LocksAndPrefaultsTheHeap) {
  SKIP_UNDER_SANITIZERS();
  const pid_t child = test::start_child([] {
    constexpr std::size_t kHeap = 16 << 20;
    if (const std::string why = lock_memory(kHeap); !why.empty()) {
      std::fprintf(stderr, "%s\n", why.c_str());
      return 77;
    }
    if (locked_kb() * 1024 < static_cast<long>(kHeap)) return 3;
    rusage before{}, after{};
    getrusage(RUSAGE_SELF, &before);
    auto* memory = new char[kHeap / 2];
    for (std::size_t i = 0; i < kHeap / 2; i += 4096) const_cast<volatile char*>(memory)[i] = 1;
    getrusage(RUSAGE_SELF, &after);
    delete[] memory;
    return after.ru_minflt - before.ru_minflt < 16 ? 0 : 4;  // 2048 pages touched
  });
  const int status = test::wait_for(child);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "memory cannot be locked here";
  EXPECT_EQ(status, 0);
}

TEST(LockMemory, RefusalIsTold) {
  SKIP_UNDER_SANITIZERS();
  const pid_t child = test::start_child([] {
    if (!become_plain()) return 2;
    return lock_memory(1 << 20).find("mlockall") != std::string::npos ? 0 : 3;
  });
  EXPECT_EQ(test::wait_for(child), 0);
}

TEST(Descriptions, SayWhatTheKernelSays) {
  EXPECT_FALSE(kernel_description().empty());
  EXPECT_NE(host_description().find("core"), std::string::npos);
  EXPECT_EQ(kernel_is_preempt_rt(), kernel_description().find("PREEMPT_RT") != std::string::npos);
}

TEST(CpuLatencyHold, SaysWhetherItHolds) {
  const CpuLatencyHold hold;
  EXPECT_EQ(hold.held(), access("/dev/cpu_dma_latency", W_OK) == 0);
}

}  // namespace
}  // namespace wasp::rt
