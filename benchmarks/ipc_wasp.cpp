// The wasp ends: broadcast ring with bells.
#include <string>

#include "benchmarks/ipc_run.h"
#include "shm/broadcast_ring.h"

namespace wasp::bench {
namespace {

class Writer {
 public:
  explicit Writer(const shm::Region& region)
      : ring_(region, "gray", "Frame"), bell_(*region.bell(region.topic("gray"))) {}
  std::byte* loan() noexcept { return ring_.loan(); }
  void before_copy(Before before) noexcept {
    if (before == Before::kAnnounce) ring_.announce();
    if (before == Before::kRing) bell_.ring();
  }
  void publish(TimeNs published_at_ns) noexcept { ring_.publish(published_at_ns); }

 private:
  shm::RingWriter ring_;
  rt::Bell& bell_;
};

class Reader {
 public:
  explicit Reader(const shm::Region& region) : ring_(region, "gray", "Frame") {}
  bool wait() noexcept { return ring_.wait(rt::now() + 100 * kMillisecond); }
  bool take(FrameHeader& head) noexcept {
    const shm::Sample sample = ring_.next();
    if (!sample) return false;
    std::memcpy(&head, sample.data, sizeof head);
    return ring_.intact(sample);
  }

 private:
  shm::RingReader ring_;
};

shm::Region attach_when_there(const std::string& name) {
  for (int i = 0;; ++i) try {
      return shm::Region::attach_with_bells(name);
    } catch (const std::exception&) {
      if (i == 5000) throw;
      rt::sleep_until(rt::now() + kMillisecond);
    }
}

}  // namespace

int wasp_writer(const std::string& name, Run& run) {
  const std::vector<shm::TopicSpec> specs{{"gray", "Frame", shm::TopicKind::kRing, 8, kFrameBytes}};
  const shm::Region region = shm::Region::create(name, specs);
  Writer writer(region);
  return write_frames(writer, run);
}

int wasp_reader(const std::string& name, Run& run) {
  const shm::Region region = attach_when_there(name);
  Reader reader(region);
  return read_frames(reader, run);
}

}  // namespace wasp::bench
