// Whatever the bytes of a region say, a reader either refuses it or stays inside the file. Each header byte is spoiled
// in turn, then many at once, then the rings; a reader that left the mapping would die, and the test with it.
#include <fcntl.h>
#include <sys/stat.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/shm/fixture.h"

namespace wasp::shm {
namespace {

class Corruption : public NamedRegion {
 protected:
  void SetUp() override {
    const std::vector<TopicSpec> specs{{"a", "T", TopicKind::kRing, 3, 128}, {"b", "U", TopicKind::kBlock, 1, 192}};
    {
      const Region region = Region::create(name_, specs);
      RingWriter writer(region, "a");
      for (std::uint64_t n = 1; n <= 5; ++n) writer.write(std::array<std::uint64_t, 16>{n}, 1);
    }
    std::ifstream file(path(), std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), {});
    ASSERT_GE(bytes_.size(), sizeof(RegionHeader));
  }

  [[nodiscard]] std::string path() const { return "/dev/shm/" + name_; }

  void put(const std::vector<char>& bytes) {
    const int fd = open(path().c_str(), O_WRONLY);
    ASSERT_GE(fd, 0);
    ASSERT_EQ(pwrite(fd, bytes.data(), bytes.size(), 0), static_cast<ssize_t>(bytes.size()));
    close(fd);
  }

  /// Attaches, and if that is granted reads everything the directory offers. True if attached.
  bool read_all() {
    try {
      const Region region = Region::attach(name_);
      for (const auto& e : region.topics()) read_topic(region, e);
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }

  void read_topic(const Region& region, const TopicEntry& e) {
    ASSERT_GE(e.offset, kPage);
    ASSERT_LE(e.offset, bytes_.size());
    ASSERT_LE(e.bytes, bytes_.size() - e.offset);
    touch(region.at(e.offset), e.bytes);
    if (e.kind != TopicKind::kRing) return;
    RingReader reader(region, std::string(e.name_view()));
    reader.rewind();
    for (std::uint32_t i = 0; i < 2 * e.slots; ++i)
      if (const Sample sample = reader.next()) touch(sample.data, reader.payload_bytes());
    if (const Sample sample = reader.latest()) touch(sample.data, reader.payload_bytes());
    std::array<std::uint64_t, 16> value{};
    reader.copy_newest(value);
    reader.read(value);
    for (const std::uint64_t n : {std::uint64_t{1}, UINT64_MAX, UINT64_MAX / 2})
      if (const Sample sample = reader.look(n)) touch(sample.data, reader.payload_bytes());
  }

  void touch(const std::byte* data, std::uint64_t bytes) {
    for (std::uint64_t i = 0; i < bytes; ++i)
      sum_ += static_cast<unsigned>(*const_cast<const volatile std::byte*>(data + i));
  }

  std::vector<char> bytes_;
  std::uint64_t sum_ = 0;
};

TEST_F(Corruption, EveryHeaderByteSpoiledInTurn) {
  ASSERT_TRUE(read_all());
  std::mt19937 random(1);
  int attached = 0, refused = 0;
  for (std::size_t i = 0; i < sizeof(RegionHeader); ++i)
    for (const int value : {0x00, 0x01, 0x40, 0xff, static_cast<int>(random() & 0xff)}) {
      auto spoiled = bytes_;
      spoiled[i] = static_cast<char>(value);
      put(spoiled);
      ++(read_all() ? attached : refused);
    }
  EXPECT_GT(attached, 0);  // names, note, unused rows
  EXPECT_GT(refused, 100);
}

TEST_F(Corruption, ManyHeaderBytesSpoiledAtOnce) {
  std::mt19937 random(2);
  for (int round = 0; round < 4000; ++round) {
    auto spoiled = bytes_;
    // Magic, version, count and size stay, so that the rows themselves are put to the test.
    const std::size_t rows = offsetof(RegionHeader, topics), end = rows + 2 * sizeof(TopicEntry);
    for (std::uint32_t i = 0; i < 1 + random() % 8; ++i)
      spoiled[rows + random() % (end - rows)] = static_cast<char>(random());
    put(spoiled);
    read_all();
  }
}

TEST_F(Corruption, RowsWithExtremeNumbers) {
  const std::uint64_t extremes[] = {0,          1,          2,          63,         64,         127,
                                    128,        4095,       4096,       4160,       8192,       1ull << 20,
                                    1ull << 31, 1ull << 32, 1ull << 44, 1ull << 58, 1ull << 63, UINT64_MAX};
  std::mt19937 random(3);
  const auto pick = [&] { return extremes[random() % std::size(extremes)]; };
  for (int round = 0; round < 20000; ++round) {
    auto spoiled = bytes_;
    TopicEntry e;
    std::memcpy(&e, spoiled.data() + offsetof(RegionHeader, topics), sizeof e);
    if (random() % 2 == 0) e.slots = static_cast<std::uint32_t>(pick());
    if (random() % 2 == 0) e.payload_bytes = pick();
    if (random() % 2 == 0) e.offset = pick();
    e.bytes = random() % 2 == 0 ? pick() : ring_bytes(e.slots, e.payload_bytes);
    std::memcpy(spoiled.data() + offsetof(RegionHeader, topics), &e, sizeof e);
    put(spoiled);
    read_all();
  }
}

TEST_F(Corruption, RingsSpoiledUnderAValidDirectory) {
  std::mt19937_64 random(4);
  for (int round = 0; round < 4000; ++round) {
    auto spoiled = bytes_;
    for (std::uint32_t i = 0; i < 1 + random() % 16; ++i) {
      const std::size_t at = kPage + random() % ((spoiled.size() - kPage) / 8) * 8;
      const std::uint64_t value = random() % 2 == 0 ? random() : UINT64_MAX - random() % 8;
      std::memcpy(spoiled.data() + at, &value, sizeof value);
    }
    put(spoiled);
    ASSERT_TRUE(read_all());
  }
}

TEST_F(Corruption, ARingThatNoWriterLeavesSoIsNotTakenOver) {
  const std::vector<TopicSpec> specs{{"a", "T", TopicKind::kRing, 3, 128}, {"b", "U", TopicKind::kBlock, 1, 192}};
  put(bytes_);
  EXPECT_EQ(RingWriter(Region::create(name_, specs), "a").published(), 5u) << "history stays";
  for (const std::uint64_t published :
       {UINT64_MAX, UINT64_MAX / 2 + 1, std::uint64_t{6}, std::uint64_t{4}, std::uint64_t{1}}) {
    auto spoiled = bytes_;
    std::memcpy(spoiled.data() + kPage, &published, sizeof published);
    put(spoiled);
    // Message 4 is whole too: an older number is only history lost.
    const Region successor = Region::create(name_, specs);
    EXPECT_EQ(RingWriter(successor, "a").published(), published == 4 ? 4u : 0u) << published;
    ASSERT_TRUE(RingWriter(successor, "a").write(std::array<std::uint64_t, 16>{7}, 1));
    std::array<std::uint64_t, 16> value{};
    EXPECT_TRUE(RingReader(successor, "a").copy_newest(value));
    EXPECT_EQ(value[0], 7u);
  }
}

TEST_F(Corruption, ExtentThatOverflows64BitsIsRefused) {
  // A file of 2^46 bytes, all hole but its first page, whose row has slots * stride = 2^64: the product is 0 to a
  // program that does not look, and the second slot lies outside the mapping.
  auto spoiled = bytes_;
  auto* header = reinterpret_cast<RegionHeader*>(spoiled.data());
  const std::uint64_t total = 1ull << 46;
  ASSERT_EQ(truncate(path().c_str(), static_cast<off_t>(total)), 0);
  header->total_bytes = total;
  header->topic_count = 1;
  TopicEntry e = header->topics[0];
  e.slots = 1u << 19;
  e.payload_bytes = (1ull << 45) - 64;
  e.bytes = ring_bytes(e.slots, e.payload_bytes);
  ASSERT_EQ(e.bytes, 64u);
  header->topics[0] = e;
  put(spoiled);
  EXPECT_FALSE(read_all());
}

TEST_F(Corruption, LaterCorruptionDoesNotMoveAnAttachedReader) {
  const Region region = Region::attach(name_);
  RingReader reader(region, "a", "T");
  auto spoiled = bytes_;
  std::memset(spoiled.data(), 0xff, kPage);
  put(spoiled);
  EXPECT_EQ(region.topics().size(), 2u);
  std::array<std::uint64_t, 16> value{};
  EXPECT_TRUE(reader.copy_newest(value));
  EXPECT_EQ(value[0], 5u);
}

}  // namespace
}  // namespace wasp::shm
