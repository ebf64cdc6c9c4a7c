// What is done to others' threads and files is done, and taken back.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/syscall.h>

#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>
#include <thread>

#include "faults/region_tamper.h"
#include "faults/thread_tamper.h"
#include "rt/clock.h"
#include "shm/region.h"
#include "tests/support/child.h"

namespace wasp::faults {
namespace {

/// A child with two threads that count.
struct TwoThreads {
  struct Page {
    std::atomic<pid_t> tid{0};
    std::atomic<std::uint64_t> first{0}, second{0};
  };
  TwoThreads()
      : page(*new (mmap(nullptr, sizeof(Page), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Page),
        pid(wasp::test::start_child([this] {
          std::thread first([this] {
            page.tid = static_cast<pid_t>(syscall(SYS_gettid));
            for (;; rt::sleep_until(rt::now() + kMillisecond)) ++page.first;
          });
          for (;; rt::sleep_until(rt::now() + kMillisecond)) ++page.second;
          return 0;
        })) {}
  ~TwoThreads() {
    wasp::test::kill_and_wait(pid);
    munmap(&page, sizeof(Page));
  }
  TwoThreads(const TwoThreads&) = delete;
  TwoThreads& operator=(const TwoThreads&) = delete;
  [[nodiscard]] bool goes_on(const std::atomic<std::uint64_t>& count) const {
    const std::uint64_t before = count;
    return wasp::test::eventually([&] { return count > before + 3; });
  }
  Page& page;
  pid_t pid;
};

TEST(ThreadStop, OneThreadStandsWhileItsProcessGoesOnAndThenItGoesOn) {
  TwoThreads child;
  ASSERT_TRUE(wasp::test::eventually([&] { return child.page.tid != 0 && child.page.first > 0; }));
  {
    const ThreadStop stop(child.page.tid);
    ASSERT_TRUE(stop.stopped());
    const std::uint64_t stands_at = child.page.first;
    EXPECT_TRUE(child.goes_on(child.page.second));
    EXPECT_EQ(child.page.first, stands_at);
  }
  EXPECT_TRUE(child.goes_on(child.page.first));
}

TEST(ThreadStop, AProcessKilledMeanwhileIsGoneAtOnceForItsParent) {
  TwoThreads child;
  ASSERT_TRUE(wasp::test::eventually([&] { return child.page.tid != 0; }));
  const ThreadStop stop(child.page.tid);
  ASSERT_TRUE(stop.stopped());
  const int status = wasp::test::kill_and_wait(child.pid, SIGKILL);  // hangs if the tracer does not reap its thread
  EXPECT_TRUE(WIFSIGNALED(status));
  child.pid = wasp::test::start_child([] { return 0; });  // for the destructor
}

TEST(ThreadStop, SaysWhenThereIsNoSuchThread) { EXPECT_FALSE(ThreadStop(-1).stopped()); }

TEST(SchedulingTheft, IsTakenBack) {
  TwoThreads child;
  ASSERT_TRUE(wasp::test::eventually([&] { return child.page.tid != 0; }));
  const pid_t tid = child.page.tid;
  {
    const SchedulingTheft theft(tid);
    ASSERT_TRUE(theft.policy(SCHED_BATCH, 0));
    EXPECT_EQ(sched_getscheduler(tid), SCHED_BATCH);
  }
  EXPECT_EQ(sched_getscheduler(tid), SCHED_OTHER);
}

TEST(RegionTamper, FlipsAsManyBitsAsAskedAndOnlyThere) {
  const std::string name = wasp::test::unique_name("tamper");
  const std::string path = "/dev/shm/" + name;
  std::ofstream(path) << std::string(8192, '\0');
  ASSERT_TRUE(flip_bits(name, 4096, 0, 1, 3));
  std::ifstream file(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), {});
  int flipped = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    flipped += std::popcount(static_cast<unsigned char>(bytes[i]));
    if (i < 4096) {
      EXPECT_EQ(bytes[i], 0);
    }
  }
  EXPECT_EQ(flipped, 1);
  ASSERT_TRUE(cut_short(name, 100));
  EXPECT_EQ(std::filesystem::file_size(path), 100u);
  unlink(path.c_str());
  EXPECT_FALSE(flip_bits(name, 0, 0, 1, 3));
}

TEST(RegionTamper, ASecondWriterIsRefusedWhileTheFirstLives) {
  const std::string name = wasp::test::unique_name("writer");
  const shm::TopicSpec topic{"t", "T", shm::TopicKind::kRing, 4, 64};
  {
    const auto region = shm::Region::create(name, {&topic, 1});
    EXPECT_TRUE(second_writer_refused(name));
  }
  EXPECT_FALSE(second_writer_refused(name));
  shm::Region::remove(name);
}

}  // namespace
}  // namespace wasp::faults
