// Writers and readers that die or stop at any instant. One test kills a writer at random instants, start-up included,
// hundreds of times, under the eyes of readers in another process; one does the same to readers while the writer must
// go on. stepping_test.cpp kills at every single step instead.
#include <sys/mman.h>

#include <atomic>
#include <random>

#include "rt/clock.h"
#include "tests/shm/fixture.h"

namespace wasp::shm {
namespace {

/// Words that survive the processes: counters between a test and its children.
struct Shared {
  std::atomic<std::uint64_t> accepted, wrong, backwards, passes, stop;
};

class Crash : public NamedRegion {
 protected:
  Crash()
      : shared_(*static_cast<Shared*>(
            mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {}
  ~Crash() override { munmap(&shared_, sizeof(Shared)); }

  /// Publishes for ever, in place.
  [[noreturn]] static void write_for_ever(const Region& region) {
    RingWriter writer(region, "data");
    for (;;) {
      const std::uint64_t n = writer.published() + 1;
      fill(writer.loan(), n);
      writer.publish(static_cast<TimeNs>(n));
    }
  }

  /// Reads whatever there is and keeps the score.
  void look(RingReader& reader, std::uint64_t& last) {
    const Sample sample = reader.next();
    shared_.passes.fetch_add(1);
    if (!sample) return;
    const bool whole =
        holds(sample.data, sample.number) && sample.published_at_ns == static_cast<TimeNs>(sample.number);
    if (!reader.intact(sample)) return;
    shared_.accepted.fetch_add(1);
    if (!whole) shared_.wrong.fetch_add(1);
    if (sample.number <= last) shared_.backwards.fetch_add(1);
    last = sample.number;
  }

  Shared& shared_;
};

TEST_F(Crash, WriterKilledAtRandomInstantsNeverMisleadsAReader) {
  constexpr int kKills = 400;
  { const Region region = Region::create(name_, one_ring(4)); }
  const pid_t reader = test::start_child([&] {
    const Region region = Region::attach(name_);
    RingReader ring(region, "data");
    std::uint64_t last = 0;
    while (shared_.stop.load() == 0) look(ring, last);
    return 0;
  });
  std::mt19937 random(1);
  std::uint64_t newest = 0;
  for (int i = 0; i < kKills; ++i) {
    const pid_t writer = test::start_child([&]() -> int { write_for_ever(Region::create(name_, one_ring(4))); });
    rt::sleep_until(rt::now() + static_cast<DurationNs>(random() % 3'000) * kMicrosecond);  // start-up is about 300 us
    ASSERT_TRUE(WIFSIGNALED(test::kill_and_wait(writer)));
    const Region region = Region::attach(name_);  // valid at whatever instant it died
    RingReader ring(region, "data");
    ASSERT_GE(ring.newest(), newest);
    newest = ring.newest();
    if (newest == 0) continue;
    const Sample sample = ring.look(newest);
    ASSERT_TRUE(sample) << "newest message gone after kill " << i;
    ASSERT_TRUE(holds(sample.data, newest));
  }
  shared_.stop = 1;
  EXPECT_EQ(test::wait_for(reader), 0);
  EXPECT_GT(newest, 0u);
  EXPECT_GT(shared_.accepted.load(), 0u);
  EXPECT_EQ(shared_.wrong.load(), 0u);
  EXPECT_EQ(shared_.backwards.load(), 0u);
  const Region region = Region::create(name_, one_ring(4));
  EXPECT_GT(region.header().writer_restarts.load(), 10u);
  RecordProperty("published", std::to_string(newest));
}

TEST_F(Crash, ReadersKilledAndStoppedAtRandomNeverHoldTheWriterUp) {
  const Region region = Region::create(name_, one_ring(4));
  const pid_t writer = test::start_child([&]() -> int {
    const std::string other = name_ + ".w";
    const Region own = Region::create(other, one_ring(4));
    write_for_ever(own);
  });
  const std::string other = name_ + ".w";
  ASSERT_TRUE(test::eventually([&] { return error_of([&] { Region::attach_with_bells(other); }).empty(); }));
  const Region mine = Region::attach(other);
  const RingReader progress(mine, "data");
  std::mt19937 random(2);
  for (int i = 0; i < 150; ++i) {
    const bool sleeps = random() % 2 == 0, stopped = random() % 2 == 0;
    const pid_t reader = test::start_child([&] {
      const Region seen = sleeps ? Region::attach_with_bells(other) : Region::attach(other);
      RingReader ring(seen, "data");
      std::uint64_t last = 0;
      for (;;) {
        if (sleeps) ring.wait(rt::now() + kSecond);
        look(ring, last);
      }
      return 0;
    });
    rt::sleep_until(rt::now() + static_cast<DurationNs>(random() % 2'000) * kMicrosecond);
    if (stopped) kill(reader, SIGSTOP);
    const std::uint64_t before = progress.newest();
    EXPECT_TRUE(test::eventually([&] { return progress.newest() > before + 10; })) << "writer stands still";
    test::kill_and_wait(reader);
    const std::uint64_t after = progress.newest();
    EXPECT_TRUE(test::eventually([&] { return progress.newest() > after + 10; })) << "writer stands still";
  }
  test::kill_and_wait(writer);
  EXPECT_GT(shared_.accepted.load(), 0u);
  EXPECT_EQ(shared_.wrong.load(), 0u);
  Region::remove(other);
}

}  // namespace
}  // namespace wasp::shm
