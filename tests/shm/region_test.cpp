// Create, attach, take over, refuse: what a region promises to writers and to readers.
#include "shm/region.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <fstream>

#include "tests/shm/fixture.h"

namespace wasp::shm {
namespace {

class RegionTest : public NamedRegion {
 protected:
  [[nodiscard]] std::string path() const { return "/dev/shm/" + name_; }
};

TEST_F(RegionTest, ReaderSeesWhatTheWriterLaidOut) {
  std::vector<TopicSpec> specs = one_ring(4);
  specs.push_back({"table", "Table", TopicKind::kBlock, 1, 1000});
  const Region writer = Region::create(name_, specs, "NOT REAL TIME");
  const Region reader = Region::attach(name_);
  EXPECT_FALSE(reader.writable());
  ASSERT_EQ(reader.topics().size(), 2u);
  EXPECT_EQ(reader.topic("data", "Message").slots, 4u);
  EXPECT_EQ(reader.topic("table").payload_bytes, 1024u);
  EXPECT_TRUE(reader.has("table"));
  EXPECT_FALSE(reader.has("tab"));
  EXPECT_STREQ(reader.header().note.data(), "NOT REAL TIME");
  EXPECT_EQ(reader.header().writer_pid.load(), getpid());
  EXPECT_EQ(Region::list(name_), std::vector<std::string>{name_});
}

TEST_F(RegionTest, SecondWriterIsRefusedInThisProcessAndInAnother) {
  const Region first = Region::create(name_, one_ring(4));
  EXPECT_NE(error_of([&] { Region::create(name_, one_ring(4)); }).find("one writer only"), std::string::npos);
  const pid_t child = test::start_child([&] {
    return error_of([&] { Region::create(name_, one_ring(4)); }).find("one writer only") != std::string::npos ? 0 : 1;
  });
  EXPECT_EQ(test::wait_for(child), 0);
}

TEST_F(RegionTest, TakeoverAfterTheWritersDeathKeepsHistoryAndNumbering) {
  const pid_t child = test::start_child([&] {
    const Region region = Region::create(name_, one_ring(8));
    RingWriter writer(region, "data");
    for (std::uint64_t n = 1; n <= 5; ++n) writer.write(Message::of(n), 0);
    static_cast<void>(writer.loan());
    raise(SIGKILL);
    return 1;
  });
  ASSERT_TRUE(WIFSIGNALED(test::wait_for(child)));
  const Region observer = Region::attach(name_);
  EXPECT_FALSE(observer.writer_alive());
  const Region region = Region::create(name_, one_ring(8));
  EXPECT_TRUE(observer.writer_alive());
  EXPECT_EQ(region.header().writer_restarts.load(), 1u);
  RingWriter writer(region, "data");
  EXPECT_EQ(writer.published(), 5u);
  writer.write(Message::of(6), 0);
  RingReader reader(observer, "data");
  reader.rewind();
  for (std::uint64_t n = 1; n <= 6; ++n) {
    const Sample sample = reader.next();
    ASSERT_EQ(sample.number, n);
    EXPECT_TRUE(holds(sample.data, n));
  }
}

TEST_F(RegionTest, WriterAliveMeansTheLockNotTheProcess) {
  Region observer = [&] {
    const Region writer = Region::create(name_, one_ring(4));
    Region reader = Region::attach(name_);
    EXPECT_TRUE(reader.writer_alive());
    return reader;
  }();
  EXPECT_FALSE(observer.writer_alive());  // this process lives on, and writes no more
  const Region again = Region::create(name_, one_ring(4));
  EXPECT_TRUE(observer.writer_alive());
}

TEST_F(RegionTest, AnUnreapedWriterIsNotAlive) {
  const pid_t child = test::start_child([&] {
    const Region region = Region::create(name_, one_ring(4));
    pause();
    return 0;
  });
  ASSERT_TRUE(test::eventually([&] { return error_of([&] { Region::attach(name_); }).empty(); }));
  const Region observer = Region::attach(name_);
  EXPECT_TRUE(observer.writer_alive());
  kill(child, SIGKILL);
  EXPECT_TRUE(test::eventually([&] { return !observer.writer_alive(); }));  // a zombie still has its number
  test::wait_for(child);
}

TEST_F(RegionTest, AskingWhetherTheWriterLivesNeverLocksTheWriterOut) {
  { const Region region = Region::create(name_, one_ring(4)); }
  const pid_t asker = test::start_child([&] {
    const Region observer = Region::attach(name_);
    for (;;) static_cast<void>(observer.writer_alive());
    return 0;
  });
  for (int i = 0; i < 500; ++i) EXPECT_EQ(error_of([&] { Region::create(name_, one_ring(4)); }), "");
  test::kill_and_wait(asker);
}

/// Another layout must get a file of its own, of the same size or not: readers keep the old one, frozen and whole.
class OtherLayout : public RegionTest, public ::testing::WithParamInterface<std::vector<TopicSpec>> {};

TEST_P(OtherLayout, LeavesOldReadersTheirOwn) {
  {
    const Region region = Region::create(name_, one_ring(4));
    RingWriter(region, "data").write(Message::of(1), 0);
  }
  const Region observer = Region::attach(name_);
  RingReader reader(observer, "data");
  const Region other = Region::create(name_, GetParam());
  EXPECT_EQ(other.header().writer_restarts.load(), 0u);
  EXPECT_EQ(reader.newest(), 1u);
  EXPECT_TRUE(holds(reader.look(1).data, 1));
  EXPECT_EQ(observer.header().topic_count, 1u);
  EXPECT_FALSE(observer.writer_alive());  // nobody writes that file any more
  EXPECT_EQ(Region::attach(name_).topics().size(), GetParam().size());
}

INSTANTIATE_TEST_SUITE_P(
    Region, OtherLayout,
    ::testing::Values(one_ring(8), one_ring(4, 64),
                      std::vector<TopicSpec>{{"atad", "Message", TopicKind::kRing, 4, sizeof(Message)}},
                      std::vector<TopicSpec>{{"data", "Massage", TopicKind::kRing, 4, sizeof(Message)}}));

TEST_F(RegionTest, LayoutsThatCannotBeAreNamed) {
  const auto create = [&](std::vector<TopicSpec> specs) { return error_of([&] { Region::create(name_, specs); }); };
  EXPECT_NE(create({{"", "T", TopicKind::kRing, 4, 64}}).find("bad topic name"), std::string::npos);
  EXPECT_NE(create({{std::string(40, 'x'), "T", TopicKind::kRing, 4, 64}}).find("bad topic name"), std::string::npos);
  EXPECT_NE(create({{"a", std::string(24, 'T'), TopicKind::kRing, 4, 64}}).find("bad topic type"), std::string::npos);
  EXPECT_NE(create({{"a", "T", TopicKind::kRing, 1, 64}}).find("no room"), std::string::npos);
  EXPECT_NE(create({{"a", "T", TopicKind::kRing, 4, 0}}).find("no room"), std::string::npos);
  EXPECT_NE(create({{"a", "T", TopicKind::kRing, 4, 64}, {"a", "U", TopicKind::kRing, 4, 64}}).find("twice"),
            std::string::npos);
  EXPECT_NE(create(std::vector<TopicSpec>(kMaxTopics + 1, {"a", "T", TopicKind::kRing, 4, 64}))
                .find(std::to_string(kMaxTopics)),
            std::string::npos);
  for (const char* name : {"", "a/b", "../a", "a.lock", "a.bell"}) {
    EXPECT_NE(error_of([&] { Region::create(name, one_ring(4)); }).find("bad name"), std::string::npos) << name;
    EXPECT_NE(error_of([&] { Region::attach(name); }).find("bad name"), std::string::npos) << name;
    EXPECT_NE(error_of([&] { Region::remove(name); }).find("bad name"), std::string::npos) << name;
  }
}

TEST_F(RegionTest, AbsentRegionIsNamed) {
  const std::string what = error_of([&] { Region::attach(name_); });
  EXPECT_NE(what.find(name_), std::string::npos) << what;
  EXPECT_NE(what.find("No such file"), std::string::npos) << what;
}

TEST_F(RegionTest, ReadOnlyMeansReadOnly) {
  const Region writer = Region::create(name_, one_ring(4));
  for (const bool with_bells : {false, true}) {
    const pid_t child = test::start_child([&] {
      signal(SIGSEGV, SIG_DFL);  // a sanitizer's handler would turn it into an exit
      const Region region = with_bells ? Region::attach_with_bells(name_) : Region::attach(name_);
      *reinterpret_cast<volatile char*>(region.at(region.topic("data").offset)) = 1;
      return 0;
    });
    const int status = test::wait_for(child);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGSEGV) << status;
  }
  EXPECT_EQ(RingReader(writer, "data").newest(), 0u);
}

TEST_F(RegionTest, FullSharedMemoryIsAClearErrorAndLeavesNoWreck) {
  const pid_t child = test::start_child([&] {
    if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        mount("tmpfs", "/dev/shm", "tmpfs", 0, "size=256k") != 0)
      return 77;
    const std::string what = error_of([&] { Region::create(name_, one_ring(8, 1 << 20)); });
    if (what.find("cannot reserve") == std::string::npos || what.find("No space") == std::string::npos) return 1;
    if (error_of([&] { Region::attach(name_); }).find("No such file") == std::string::npos) return 2;
    return error_of([&] { Region::create(name_, one_ring(8, 1024)); }).empty() ? 0 : 3;
  });
  const int status = test::wait_for(child);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "no mount namespace without root";
  EXPECT_EQ(status, 0);
}

TEST_F(RegionTest, TruncatedAndEmptyFilesAreRefused) {
  { const Region region = Region::create(name_, one_ring(4)); }
  struct stat st {};
  ASSERT_EQ(stat(path().c_str(), &st), 0);
  for (const off_t size : {st.st_size - 1, st.st_size - 4096, off_t{4096}, off_t{4095}, off_t{1}, off_t{0}}) {
    ASSERT_EQ(truncate(path().c_str(), size), 0);
    EXPECT_NE(error_of([&] { Region::attach(name_); }), "") << size;
  }
  EXPECT_EQ(error_of([&] { Region::create(name_, one_ring(4)); }), "");  // and the next writer mends it
  EXPECT_EQ(error_of([&] { Region::attach(name_); }), "");
}

TEST_F(RegionTest, FileWithHolesIsRefused) {
  { const Region region = Region::create(name_, one_ring(4)); }
  struct stat st {};
  ASSERT_EQ(stat(path().c_str(), &st), 0);
  ASSERT_EQ(truncate(path().c_str(), 4096), 0);
  ASSERT_EQ(truncate(path().c_str(), st.st_size), 0);  // header and size are right, the pages are not there
  EXPECT_NE(error_of([&] { Region::attach(name_); }).find("holes"), std::string::npos);
}

TEST_F(RegionTest, AttachedPagesAreThereBeforeTheFirstLook) {
  const Region writer = Region::create(name_, one_ring(8, 307200));
  const Region reader = Region::attach(name_);
  rusage before{}, after{};
  getrusage(RUSAGE_THREAD, &before);
  std::uint64_t sum = 0;
  for (std::uint64_t i = 0; i < reader.header().total_bytes; i += 4096)
    sum += static_cast<std::uint64_t>(*reinterpret_cast<const volatile char*>(reader.at(i)));
  getrusage(RUSAGE_THREAD, &after);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizers' shadow memory faults too";
#endif
  EXPECT_LE(after.ru_minflt - before.ru_minflt, 2);  // of some 600 pages
  EXPECT_GT(sum + 1, 0u);
}

TEST_F(RegionTest, MovesLeaveNothingBehind) {
  Region a = Region::create(name_, one_ring(4));
  const std::string other = test::unique_name("a_rather_long_name_that_needs_the_heap");
  Region b = Region::create(other, one_ring(4));
  b = std::move(a);  // under AddressSanitizer: the old name and directory of b are freed
  EXPECT_EQ(b.name(), name_);
  EXPECT_EQ(error_of([&] { Region::create(other, one_ring(4)); }), "");  // b let go of its lock
  EXPECT_NE(error_of([&] { Region::create(name_, one_ring(4)); }), "");
  Region::remove(other);
}

}  // namespace
}  // namespace wasp::shm
