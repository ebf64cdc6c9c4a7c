// The ring's promises one by one, then under load: what a reader accepts is whole and in order, beside a reader that
// does not look again after use, which the same check catches on any processor (it does not rest on memory order).
//
// What ThreadSanitizer cannot see: it knows nothing of fences, so it would call the in-place payload a race although a
// torn look is thrown away; here the payload is made of relaxed atomic words. That the fences themselves are right
// rests on the stress below, and on Boehm (MSPC 2012), not on the sanitizer.
#include "shm/broadcast_ring.h"

#include <atomic>
#include <thread>

#include "rt/clock.h"
#include "tests/shm/fixture.h"
#include "tests/support/malloc_guard.h"

namespace wasp::shm {
namespace {

class Ring : public NamedRegion {
 protected:
  Region make(std::uint32_t slots) { return Region::create(name_, one_ring(slots)); }
};

TEST_F(Ring, EmptyThenInOrder) {
  const Region region = make(4);
  RingWriter writer(region, "data", "Message");
  RingReader reader(region, "data", "Message");
  EXPECT_FALSE(reader.next());
  EXPECT_FALSE(reader.latest());
  EXPECT_FALSE(reader.look(0));
  EXPECT_FALSE(reader.look(1));
  Message m;
  EXPECT_FALSE(reader.copy_newest(m));
  for (std::uint64_t n = 1; n <= 3; ++n) ASSERT_TRUE(writer.write(Message::of(n), static_cast<TimeNs>(n)));
  for (std::uint64_t n = 1; n <= 3; ++n) {
    const Sample sample = reader.next();
    EXPECT_EQ(sample.number, n);
    EXPECT_EQ(sample.published_at_ns, static_cast<TimeNs>(n));
    EXPECT_TRUE(holds(sample.data, n));
    EXPECT_TRUE(reader.intact(sample));
  }
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(reader.lost(), 0u);
}

TEST_F(Ring, SlowReaderLosesTheOldestAndCountsThem) {
  const Region region = make(4);
  RingWriter writer(region, "data");
  RingReader reader(region, "data");
  for (std::uint64_t n = 1; n <= 10; ++n) writer.write(Message::of(n), 0);
  EXPECT_EQ(reader.next().number, 8u);  // three of four slots are safe to start on
  EXPECT_EQ(reader.lost(), 7u);
  EXPECT_EQ(reader.next().number, 9u);
  EXPECT_EQ(reader.next().number, 10u);
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(reader.lost(), 7u);
}

TEST_F(Ring, LatestPassesOverAndRewindGoesBack) {
  const Region region = make(4);
  RingWriter writer(region, "data");
  for (std::uint64_t n = 1; n <= 6; ++n) writer.write(Message::of(n), 0);
  RingReader reader(region, "data");
  EXPECT_FALSE(reader.next());  // starts at the newest
  reader.rewind();
  EXPECT_EQ(reader.next().number, 4u);
  std::uint64_t passed = 99;
  EXPECT_EQ(reader.latest(&passed).number, 6u);
  EXPECT_EQ(passed, 1u);
  EXPECT_EQ(reader.lost(), 0u);
}

TEST_F(Ring, LoanOverTheSampleInUseIsNoticed) {
  const Region region = make(2);
  RingWriter writer(region, "data");
  RingReader reader(region, "data");
  writer.write(Message::of(1), 0);
  const Sample sample = reader.next();
  ASSERT_TRUE(reader.intact(sample));
  writer.write(Message::of(2), 0);
  ASSERT_TRUE(reader.intact(sample));
  static_cast<void>(writer.loan());  // takes the first slot again
  EXPECT_FALSE(reader.intact(sample));
  EXPECT_FALSE(reader.look(1));
}

TEST_F(Ring, NextGoesOnToTheFollowingMessageWhenOneIsGone) {
  const Region region = make(8);
  RingWriter writer(region, "data");
  RingReader reader(region, "data");
  for (std::uint64_t n = 1; n <= 3; ++n) writer.write(Message::of(n), 0);
  auto* first = reinterpret_cast<SlotHeader*>(region.at(region.topic("data").offset) + sizeof(RingHeader));
  first->sequence.store(2 * 9 - 1);  // as if the writer lapped between the reader's two looks
  EXPECT_EQ(reader.next().number, 2u);
  EXPECT_EQ(reader.lost(), 1u);
}

TEST_F(Ring, LatestCountsAMessageLappedWhileItLooked) {
  const Region region = make(8);
  RingWriter writer(region, "data");
  RingReader reader(region, "data");
  writer.write(Message::of(1), 0);
  auto* first = reinterpret_cast<SlotHeader*>(region.at(region.topic("data").offset) + sizeof(RingHeader));
  first->sequence.store(2 * 9 - 1);
  EXPECT_FALSE(reader.latest());
  EXPECT_EQ(reader.lost(), 1u);
}

TEST_F(Ring, ValueThatDoesNotFitIsRefusedAndHarmsNoNeighbour) {
  const Region region = Region::create(name_, one_ring(2, 64));
  RingWriter writer(region, "data");
  const std::array<std::uint64_t, 8> small{1, 2, 3, 4, 5, 6, 7, 8};
  EXPECT_TRUE(writer.write(small, 0));
  EXPECT_TRUE(writer.write(small, 0));
  EXPECT_FALSE(writer.write(Message::of(3), 0));
  EXPECT_EQ(writer.published(), 2u);
  RingReader reader(region, "data");
  std::array<std::uint64_t, 8> back{};
  EXPECT_TRUE(reader.copy(2, back));
  EXPECT_EQ(back, small);
  Message m;
  EXPECT_FALSE(reader.copy_newest(m));
}

TEST_F(Ring, BlockTopicIsNotARing) {
  const std::vector<TopicSpec> specs{{"block", "Table", TopicKind::kBlock, 1, 64}};
  const Region region = Region::create(name_, specs);
  EXPECT_NE(error_of([&] { RingWriter(region, "block"); }).find("not a ring"), std::string::npos);
  EXPECT_NE(error_of([&] { RingReader(region, "block"); }).find("not a ring"), std::string::npos);
  EXPECT_NE(error_of([&] { RingReader(region, "absent"); }).find("no topic"), std::string::npos);
  EXPECT_NE(error_of([&] { RingReader(region, "block", "Other"); }).find("holds Table"), std::string::npos);
}

TEST_F(Ring, PublishAndReadAllocateNothing) {
  const Region region = make(8);
  RingWriter writer(region, "data");
  RingReader reader(region, "data");
  Message m = Message::of(1);
  std::uint64_t read = 0;
  const test::MallocCount count;
  {
    const rt::RealtimeSection section;
    for (int i = 0; i < 100; ++i) {
      writer.write(m, i);
      fill(writer.loan(), 2);
      writer.publish(i);
      read += reader.wait(rt::now() + kSecond) && reader.read(m) ? 1 : 0;
      read += reader.latest() ? 1 : 0;
      read += reader.copy_newest(m) ? 1 : 0;
    }
  }
  EXPECT_EQ(count.violations(), 0u);
  EXPECT_EQ(read, 300u);
}

/// What three readers at full tilt accepted while one writer published as fast as it could.
struct Outcome {
  std::uint64_t accepted = 0, wrong = 0, backwards = 0, lost = 0;
};

template <class Enough>
Outcome hammer(const Region& region, bool look_again, Enough&& enough) {
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> accepted{0}, wrong{0}, backwards{0}, lost{0};
  std::thread writing([&] {
    RingWriter writer(region, "data");
    while (!stop.load(std::memory_order_relaxed)) {
      const std::uint64_t n = writer.published() + 1;
      fill(writer.loan(), n);
      writer.publish(static_cast<TimeNs>(n));
      if (n % 256 == 0) std::this_thread::yield();
    }
  });
  std::vector<std::thread> readers;
  for (int r = 0; r < 3; ++r)
    readers.emplace_back([&, r] {
      RingReader reader(region, "data");
      std::uint64_t last = 0;
      while (!stop.load(std::memory_order_relaxed)) {
        const Sample sample = r == 0 ? reader.latest() : reader.next();
        if (!sample) continue;
        const bool whole =
            holds(sample.data, sample.number) && sample.published_at_ns == static_cast<TimeNs>(sample.number);
        if (look_again && !reader.intact(sample)) {
          reader.count_lost();
          continue;
        }
        accepted.fetch_add(1, std::memory_order_relaxed);
        if (!whole) wrong.fetch_add(1, std::memory_order_relaxed);
        if (sample.number <= last) backwards.fetch_add(1, std::memory_order_relaxed);
        last = sample.number;
      }
      lost.fetch_add(reader.lost());
    });
  const TimeNs deadline = rt::now() + 4 * kSecond;
  do {
    rt::sleep_until(rt::now() + 5 * kMillisecond);
  } while (rt::now() < deadline && !enough(Outcome{accepted, wrong, backwards, lost}));
  stop = true;
  writing.join();
  for (auto& r : readers) r.join();
  return {accepted, wrong, backwards, lost};
}

TEST_F(Ring, UnderLoadNothingTornIsAccepted) {
  const Outcome outcome = hammer(make(3), true, [](const Outcome& o) { return o.accepted > 1'500'000; });
  EXPECT_GT(outcome.accepted, 0u);
  EXPECT_EQ(outcome.wrong, 0u);
  EXPECT_EQ(outcome.backwards, 0u);
  RecordProperty("accepted", std::to_string(outcome.accepted));
  RecordProperty("lost", std::to_string(outcome.lost));
}

TEST_F(Ring, TheSameCheckCatchesAReaderThatDoesNotLookAgain) {
  EXPECT_GT(hammer(make(3), false, [](const Outcome& o) { return o.wrong > 0; }).wrong, 0u);
}

TEST_F(Ring, CopiesUnderLoadAreWhole) {
  const Region region = make(4);
  std::atomic<bool> stop{false};
  std::thread writing([&] {
    RingWriter writer(region, "data");
    for (std::uint64_t n = 1; !stop.load(std::memory_order_relaxed); ++n) {
      writer.write(Message::of(n), 0);
      if (n % 256 == 0) std::this_thread::yield();
    }
  });
  RingReader reader(region, "data");
  std::uint64_t last = 0, copies = 0;
  const TimeNs deadline = rt::now() + 4 * kSecond;
  while (copies < 100'000 && rt::now() < deadline) {
    Message m;
    const bool by_name = copies % 2 == 0;
    if (by_name ? !reader.copy_newest(m) : !reader.read(m)) continue;
    ++copies;
    const std::uint64_t n = m.words[0] * 0xF1DE83E19937733Dull;  // the inverse of word()'s factor modulo 2^64
    ASSERT_TRUE(m.is(n));
    if (!by_name) {
      ASSERT_GT(n, last);
      last = n;
    }
  }
  stop = true;
  writing.join();
  EXPECT_GT(copies, 0u);
}

}  // namespace
}  // namespace wasp::shm
