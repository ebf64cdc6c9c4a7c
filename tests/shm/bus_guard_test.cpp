// Files cut short under their mappings, for real: readers and the writer itself go on, on pages of zeros.
#include "shm/bus_guard.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "shm/shm_file.h"
#include "tests/shm/fixture.h"

namespace wasp::shm {
namespace {

class BusGuardTest : public NamedRegion {
 protected:
  BusGuardTest() { install_bus_guard(); }
  void cut(off_t bytes) const { ASSERT_EQ(truncate(path_of(name_).c_str(), bytes), 0); }
};

TEST_F(BusGuardTest, AReaderOfACutFileReadsNothingPublished) {
  const Region written = Region::create(name_, one_ring(8));
  RingWriter writer(written, "data");
  const Region region = Region::attach(name_);
  RingReader reader(region, "data");
  writer.write(Message::of(7), 1);
  Message m;
  ASSERT_TRUE(reader.copy_newest(m));
  const std::uint64_t before = lost_pages();
  cut(0);
  EXPECT_FALSE(reader.copy_newest(m));
  EXPECT_EQ(reader.newest(), 0u);
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(region.header().magic.load(), 0u);
  EXPECT_GT(lost_pages(), before);
  EXPECT_TRUE(lost_page_within(region.at(0), kPage, before));
  EXPECT_EQ(lost_names(before), name_);
  EXPECT_EQ(lost_names(lost_pages()), "memory of another kind");
}

TEST_F(BusGuardTest, TheWriterOfACutFileWritesOnInMemoryOfItsOwn) {
  const Region region = Region::create(name_, one_ring(8));
  RingWriter writer(region, "data");
  RingReader reader(region, "data");
  for (std::uint64_t n = 1; n <= 20; ++n) writer.write(Message::of(n), 1);
  const std::uint64_t before = lost_pages();
  cut(0);
  EXPECT_FALSE(reader.read(*std::make_unique<Message>()));
  for (std::uint64_t n = 1; n <= 20; ++n) ASSERT_TRUE(writer.write(Message::of(100 + n), 1));  // every slot, twice
  Message m;
  ASSERT_TRUE(reader.copy_newest(m));
  EXPECT_TRUE(m.is(120));
  EXPECT_GT(lost_pages(), before);
}

TEST_F(BusGuardTest, AFileCutInTheMiddleLosesOnlyWhatLiesBehind) {
  const Region region = Region::create(name_, {{{"front", "Message", TopicKind::kRing, 8, sizeof(Message)},
                                                {"back", "Message", TopicKind::kRing, 64, sizeof(Message)}}});
  RingWriter front(region, "front"), back(region, "back");
  RingReader front_reader(region, "front"), back_reader(region, "back");
  front.write(Message::of(1), 1);
  back.write(Message::of(2), 1);
  cut(static_cast<off_t>((region.topic("back").offset + kPage - 1) / kPage * kPage));
  Message m;
  EXPECT_TRUE(front_reader.copy_newest(m));
  EXPECT_TRUE(m.is(1));
  for (std::uint64_t n = 1; n <= 64; ++n) ASSERT_TRUE(back.write(Message::of(n), 1));
  EXPECT_TRUE(back_reader.copy_newest(m));
  EXPECT_TRUE(m.is(64));
}

TEST_F(BusGuardTest, ASleeperWhoseBellsAreCutWakesByItsDeadline) {
  const Region written = Region::create(name_, one_ring(8));
  const Region region = Region::attach_with_bells(name_);
  RingReader reader(region, "data");
  RingWriter writer(written, "data");
  ASSERT_EQ(truncate(bell_path_of(name_).c_str(), 0), 0);
  const TimeNs deadline_ns = rt::now() + 50 * kMillisecond;
  EXPECT_FALSE(reader.wait(deadline_ns));
  EXPECT_GE(rt::now(), deadline_ns);
  writer.write(Message::of(1), 1);  // rings
  EXPECT_TRUE(reader.wait(rt::now() + 50 * kMillisecond));
}

TEST_F(BusGuardTest, ThreadsThatMeetTheSameLostPagesTogetherGoOn) {
  const Region region = Region::create(name_, one_ring(64));
  RingWriter writer(region, "data");
  std::vector<std::thread> threads;
  std::atomic<bool> cut_now{false};
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      RingReader reader(region, "data");
      while (!cut_now) std::this_thread::yield();
      Message m;
      for (int k = 0; k < 200; ++k) reader.copy_newest(m);
    });
  cut(0);
  cut_now = true;
  for (std::uint64_t n = 1; n <= 200; ++n) writer.write(Message::of(n), 1);
  for (auto& t : threads) t.join();
  EXPECT_EQ(lost_names(0).empty(), false);
}

/// What is no file that was cut short is nobody's to repair.
TEST_F(BusGuardTest, AnotherBusErrorStillEndsTheProgram) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    raise(SIGBUS);
    raise(SIGBUS);  // the first one took the handler away
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGBUS);
}

}  // namespace
}  // namespace wasp::shm
