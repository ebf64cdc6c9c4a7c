// The guard must catch what it is there for, and the real-time mechanisms must give it nothing to catch.
#include "tests/support/malloc_guard.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "rt/contract.h"
#include "rt/histogram.h"
#include "rt/periodic.h"
#include "rt/seqlock.h"
#include "rt/spsc_queue.h"
#include "tests/support/child.h"

namespace wasp {
namespace {

using test::MallocCount;

TEST(MallocGuard, CatchesAVectorThatGrowsInARealtimeSection) {
  std::vector<int> numbers;
  const MallocCount count;
  numbers.push_back(1);
  EXPECT_EQ(count.violations(), 0u);  // outside
  {
    const rt::RealtimeSection section;
    for (int i = 0; i < 100; ++i) numbers.push_back(i);
  }
  EXPECT_GT(count.violations(), 0u);
}

TEST(MallocGuard, CatchesEveryEntryPoint) {
  const auto caught = [](auto&& call) {
    const MallocCount count;
    {
      const rt::RealtimeSection section;
      call();
    }
    return count.violations() > 0;
  };
  static void* volatile keep;
  static int* volatile number;
  EXPECT_TRUE(caught([] { keep = std::malloc(10); }));
  EXPECT_TRUE(caught([] { keep = std::realloc(keep, 10000); }));
  EXPECT_TRUE(caught([] { std::free(keep); }));
  EXPECT_TRUE(caught([] { keep = std::calloc(3, 10); }));
  std::free(keep);
#ifndef __SANITIZE_THREAD__  // its hooks do not speak of aligned memory
  EXPECT_TRUE(caught([] { keep = std::aligned_alloc(64, 128); }));
  std::free(keep);
  EXPECT_TRUE(caught([] {
    void* p = nullptr;
    if (posix_memalign(&p, 64, 128) == 0) keep = p;
  }));
  std::free(keep);
#endif
  EXPECT_TRUE(caught([] { number = new int(1); }));
  EXPECT_TRUE(caught([] { delete number; }));
}

TEST(MallocGuard, LooksAtTheThreadThatAllocates) {
  const MallocCount count;
  const rt::RealtimeSection section;
  {
    const rt::NonRealtimeSection pause;
    std::thread([] { std::vector<int>(1000).swap(*std::make_unique<std::vector<int>>()); }).join();
  }
  EXPECT_EQ(count.violations(), 0u);
}

TEST(MallocGuard, AbortsWhenAskedTo) {
  EXPECT_EXIT(
      {
        test::abort_on_malloc_violation(true);
        const rt::RealtimeSection section;
        static void* volatile keep;
        for (int i = 0; i < 2; ++i) keep = std::malloc(10);
        static_cast<void>(keep);
        _exit(test::malloc_violations() > 2 ? 0 : 1);  // reached only if an earlier test was first
      },
      [](int status) { return WIFSIGNALED(status) ? WTERMSIG(status) == SIGABRT : WEXITSTATUS(status) == 0; }, "");
}

TEST(MallocGuard, FindsNothingInTheRealtimeMechanisms) {
  const auto histogram = std::make_unique<rt::Histogram>();
  const auto lock = std::make_unique<rt::Seqlock<std::array<std::uint64_t, 16>>>();
  const auto queue = std::make_unique<rt::SpscQueue<int, 8>>();
  rt::PeriodicGrid grid(rt::now(), 100 * kMicrosecond);
  std::array<std::uint64_t, 16> value{};
  int item = 0;
  std::uint64_t checks = 0;
  const MallocCount count;
  {
    const rt::RealtimeSection section;
    for (int i = 0; i < 50; ++i) {
      histogram->record(rt::wait_next(grid).released_at_ns);
      checks += static_cast<std::uint64_t>(histogram->quantile_ns(0.99) != 0);
      lock->store(value);
      checks += lock->load(value) ? 1 : 0;
      checks += queue->push(i) && queue->pop(item) ? 1 : 0;
    }
  }
  EXPECT_EQ(count.violations(), 0u);
  EXPECT_EQ(checks, 150u);
}

/// Runs the contract breaker under the preloaded guard; returns the first line of the guard's report.
std::string report_of(int allocations) {
  const std::string out = ::testing::TempDir() + "wasp_malloc_guard." + std::to_string(getpid());
  const std::string lib = std::string(WASP_BINARY_DIR) + "/lib/";
  const std::string command = "LD_PRELOAD='" + lib + "libwasp_malloc_guard.so' WASP_MALLOC_GUARD_OUT='" + out + "' '" +
                              lib + "wasp_contract_breaker' " + std::to_string(allocations);
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::ifstream file(out);
  std::string line;
  std::getline(file, line);
  std::remove(out.c_str());
  return line;
}

TEST(MallocGuard, PreloadedLibraryCountsAWholeProgram) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizers own malloc";
#endif
  if (!std::ifstream(std::string(WASP_BINARY_DIR) + "/lib/libwasp_malloc_guard.so"))
    GTEST_SKIP() << "libwasp_malloc_guard.so is not built";
  EXPECT_EQ(report_of(3), "violations 3");
  EXPECT_EQ(report_of(0), "violations 0");
}

}  // namespace
}  // namespace wasp
