// The directory of a shared memory region in a file that anybody may have written. An input is a list of changes to a
// good region, and perhaps another length. Promises: attach refuses it naming the region, or every look at what it
// lists stays inside the mapping; a writer takes over or replaces it and is heard.
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <stdexcept>
#include <vector>

#include "shm/broadcast_ring.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/scratch_file.h"

namespace {

using namespace wasp;

const std::vector<shm::TopicSpec> kTopics = {{"small", "A", shm::TopicKind::kRing, 2, 64},
                                             {"block", "B", shm::TopicKind::kBlock, 1, 128},
                                             {"large", "C", shm::TopicKind::kRing, 5, 1024}};
using Payload = std::array<std::uint64_t, 8>;

const std::string& name() {
  static const std::string kName = fuzz::scratch_path("_region").filename();
  return kName;
}

struct Remover {
  std::string region = name();
  ~Remover() { shm::Region::remove(region); }
};

/// A good region with some history, as it lies in its file.
std::vector<std::uint8_t> good_region() {
  const shm::Region region = shm::Region::create(name(), kTopics, "a note");
  for (const char* topic : {"small", "large"}) {
    shm::RingWriter writer(region, topic);
    for (std::uint64_t n = 1; n <= 7; ++n) writer.write(Payload{n}, static_cast<TimeNs>(n));
  }
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(region.at(0));
  return {bytes, bytes + region.header().total_bytes};
}

void change(fuzz::FuzzInput& in, std::vector<std::uint8_t>& file) {
  const std::size_t whole = file.size();
  if (const auto shorter = in.take<std::uint8_t>(); shorter != 0) file.resize(whole * shorter / 128);
  while (!in.empty()) {
    const std::size_t at = in.take<std::uint16_t>();
    const auto bytes = in.take_bytes(in.take<std::uint8_t>() % 64u);
    for (std::size_t i = 0; i < bytes.size() && at + i < file.size(); ++i) file[at + i] = bytes[i];
  }
}

/// The same file, its pages reserved as a writer reserves them.
void put(const std::vector<std::uint8_t>& file) {
  const std::string path = "/dev/shm/" + name();
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  fuzz::require(
      fd >= 0 && ftruncate(fd, 0) == 0 && pwrite(fd, file.data(), file.size(), 0) == static_cast<ssize_t>(file.size()),
      "a region's file can be written");
  close(fd);
}

std::uint64_t look_at_all(const shm::Region& region, const shm::TopicEntry& entry) {
  std::uint64_t sum = 0;
  const std::byte* first = region.at(entry.offset);
  for (std::uint64_t i = 0; i < entry.bytes; i += 64) sum += static_cast<std::uint64_t>(first[i]);
  if (entry.kind != shm::TopicKind::kRing) return sum;
  shm::RingReader reader(region, entry.name_view());
  Payload payload;
  reader.rewind();
  for (int i = 0; i < 3; ++i) {
    if (const shm::Sample sample = reader.next()) {
      for (std::uint64_t at = 0; at < reader.payload_bytes(); at += 8)
        sum += static_cast<std::uint64_t>(sample.data[at]);
      sum += reader.intact(sample) ? 1 : 0;
    }
    sum += reader.read(payload) ? payload[0] : 0;
  }
  if (const shm::Sample sample = reader.latest()) sum += sample.number;
  return sum + (reader.copy_newest(payload) ? payload[1] : 0) + reader.lost();
}

void read_as_observer() {
  try {
    const shm::Region region = shm::Region::attach_with_bells(name());
    std::uint64_t sum = 0;
    for (const shm::TopicEntry& entry : region.topics()) {
      // By its own row: two topics of one name are one to whoever asks by name.
      fuzz::require(entry.offset + entry.bytes <= region.header().total_bytes, "topics lie in the region");
      sum += look_at_all(region, region.topic(entry.name_view()));
      sum += region.bell(entry) != nullptr ? 1 : 0;
    }
    volatile std::uint64_t keep = sum + (region.writer_alive() ? 1 : 0);
    static_cast<void>(keep);
  } catch (const std::runtime_error& error) {
    fuzz::require_clear(error.what(), name());
  }
}

void take_over() {
  const shm::Region region = shm::Region::create(name(), kTopics);
  for (const char* topic : {"small", "large"}) {
    shm::RingWriter writer(region, topic);
    shm::RingReader reader(region, topic);
    const Payload sent{writer.published() + 1, 2, 3};
    Payload got{};
    fuzz::require(writer.write(sent, 1) && reader.copy_newest(got) && got == sent, "the successor is heard");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Remover remover;
  static const std::vector<std::uint8_t> kGood = good_region();
  std::vector<std::uint8_t> file = kGood;
  fuzz::FuzzInput in(data, size);
  change(in, file);
  put(file);
  read_as_observer();
  take_over();
  return 0;
}
