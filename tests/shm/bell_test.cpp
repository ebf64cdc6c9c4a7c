// The doorbell across processes: a sleeper is woken, a dead sleeper does no harm, a time-out is honoured. Waits are
// generous and poll; nothing here bounds how fast.
#include <sys/mman.h>

#include <atomic>

#include "rt/clock.h"
#include "tests/shm/fixture.h"

namespace wasp::shm {
namespace {

class BellTest : public NamedRegion {
 protected:
  const Region region_ = Region::create(name_, one_ring(8));
  RingWriter writer_{region_, "data"};
  rt::Bell& bell_ = *region_.bell(region_.topic("data"));

  BellTest() { taken_.store(0); }
  ~BellTest() override { munmap(&taken_, sizeof taken_); }

  /// A reader in another process; it counts what it took in `taken_` and exits with 0 after `messages` wake-ups, each
  /// with the right message.
  pid_t start_reader(std::uint64_t messages) {
    return test::start_child([this, messages] {
      const Region region = Region::attach_with_bells(name_);
      RingReader reader(region, "data");
      reader.rewind();
      for (std::uint64_t n = 1; n <= messages; ++n) {
        if (!reader.wait(rt::now() + 60 * kSecond)) return 1;
        const Sample sample = reader.next();
        if (sample.number != n || !holds(sample.data, n) || !reader.intact(sample)) return 2;
        taken_.fetch_add(1);
      }
      return 0;
    });
  }
  bool somebody_sleeps() {
    return test::eventually([&] { return bell_.awaited(); });
  }
  /// Publishes the next message once the one before is taken and the reader has lain down again: it sleeps, or
  /// is about to and must not miss the ring.
  bool publish_to_sleeper() {
    const std::uint64_t n = writer_.published() + 1;
    if (!test::eventually([&] { return taken_.load() == n - 1; }) || !somebody_sleeps()) return false;
    fill(writer_.loan(), n);
    writer_.publish(0);
    return true;
  }

  std::atomic<std::uint64_t>& taken_ = *static_cast<std::atomic<std::uint64_t>*>(
      mmap(nullptr, sizeof(std::atomic<std::uint64_t>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
};

TEST_F(BellTest, SleepingReaderInAnotherProcessIsWokenForEveryMessage) {
  const pid_t reader = start_reader(50);
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(publish_to_sleeper()) << i;
  EXPECT_EQ(test::wait_for(reader), 0);
}

TEST_F(BellTest, NoWakeUpIsLostBetweenLookingAndSleeping) {
  const pid_t sleeper = test::start_child([this] {
    const Region region = Region::attach_with_bells(name_);
    RingReader reader(region, "data");
    std::uint64_t last = 0;
    while (last < 20'000) {
      const TimeNs deadline = rt::now() + 60 * kSecond;
      if (!reader.wait(deadline) || rt::now() >= deadline) return 1;  // a lost wake-up sleeps until the deadline
      const Sample sample = reader.latest();
      if (!sample) continue;
      last = sample.number;
    }
    return 0;
  });
  ASSERT_TRUE(somebody_sleeps());
  for (std::uint64_t n = 1; n <= 20'000; ++n) {
    static_cast<void>(writer_.loan());
    writer_.publish(0);
    for (std::uint64_t spin = 0; spin < n % 64 * 8; ++spin) __builtin_ia32_pause();
  }
  EXPECT_EQ(test::wait_for(sleeper), 0);
}

TEST_F(BellTest, DeadAndStoppedSleepersCostOneNeedlessCallAtMostAndDoNoHarm) {
  for (int dead = 0; dead < 5; ++dead) {
    const pid_t reader = start_reader(1000);
    ASSERT_TRUE(somebody_sleeps());
    if (dead % 2 == 0) kill(reader, SIGSTOP);
    if (dead % 2 != 0) test::kill_and_wait(reader);
    bell_.ring();
    EXPECT_FALSE(bell_.awaited());  // the next ring makes no system call
    if (dead % 2 == 0) test::kill_and_wait(reader);
  }
  const pid_t survivor = start_reader(20);
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(publish_to_sleeper()) << i;
  EXPECT_EQ(test::wait_for(survivor), 0);
}

TEST_F(BellTest, TimeOutIsHonoured) {
  RingReader reader(region_, "data");
  for (const DurationNs wait_ns : {DurationNs{-kSecond}, DurationNs{0}, 20 * kMillisecond}) {
    const TimeNs deadline = rt::now() + wait_ns;
    EXPECT_FALSE(reader.wait(deadline));
    EXPECT_GE(rt::now(), deadline);
  }
  EXPECT_FALSE(reader.wait(kNever));
}

TEST_F(BellTest, SleeperOutlivesTheWriterAndIsWokenByItsSuccessor) {
  const std::string name = name_ + ".second";
  const auto write_one = [&](std::uint64_t n) {
    return test::start_child([&, n] {
      const Region region = Region::create(name, one_ring(8));
      RingWriter writer(region, "data");
      if (!test::eventually([&] { return region.bell(region.topic("data"))->awaited(); })) return 1;
      fill(writer.loan(), n);
      writer.publish(0);
      raise(SIGKILL);
      return 2;
    });
  };
  const pid_t reader = test::start_child([&] {
    if (!test::eventually([&] { return error_of([&] { Region::attach_with_bells(name); }).empty(); })) return 1;
    const Region region = Region::attach_with_bells(name);
    RingReader ring(region, "data");
    for (std::uint64_t n = 1; n <= 3; ++n)
      if (!ring.wait(rt::now() + 60 * kSecond) || ring.next().number != n) return static_cast<int>(1 + n);
    return 0;
  });
  for (std::uint64_t n = 1; n <= 3; ++n) EXPECT_TRUE(WIFSIGNALED(test::wait_for(write_one(n)))) << n;
  EXPECT_EQ(test::wait_for(reader), 0);
  Region::remove(name);
}

TEST_F(BellTest, AnnouncedSleeperGetsTheMessageAndAnEmptyAnnouncementDoesNoHarm) {
  const pid_t reader = start_reader(50);
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(test::eventually([&] { return taken_.load() == writer_.published(); }) && somebody_sleeps()) << i;
    std::byte* loan = writer_.loan();
    writer_.announce();
    if (i % 5 == 0) {  // nothing follows: the reader goes back to sleep
      ASSERT_TRUE(somebody_sleeps());
    }
    fill(loan, writer_.published() + 1);
    writer_.publish(0);
  }
  EXPECT_EQ(test::wait_for(reader), 0);
}

TEST_F(BellTest, TimeOutIsHonouredAfterAnEmptyAnnouncement) {
  const pid_t reader = test::start_child([this] {
    const Region region = Region::attach_with_bells(name_);
    RingReader ring(region, "data");
    const TimeNs deadline = rt::now() + 300 * kMillisecond;
    return !ring.wait(deadline) && rt::now() >= deadline ? 0 : 1;
  });
  siginfo_t ended{};
  while (waitid(P_PID, static_cast<id_t>(reader), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 && ended.si_pid != reader) {
    writer_.announce();
    rt::sleep_until(rt::now() + kMillisecond);
  }
  EXPECT_EQ(test::wait_for(reader), 0);
}

TEST_F(BellTest, ObserverWithoutBellsIsNeverPutToSleep) {
  const Region observer = Region::attach(name_);
  RingReader reader(observer, "data");
  EXPECT_EQ(observer.bell(observer.topic("data")), nullptr);
  EXPECT_FALSE(reader.wait(rt::now() + 3600 * kSecond));  // answers at once
}

}  // namespace
}  // namespace wasp::shm
