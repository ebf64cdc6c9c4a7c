// The kernel's own means: a page with one header and a futex or an eventfd to wake by, and a pipe that carries the
// whole frame. No ring, no sequence check: the floor under any wake-up.
#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include "benchmarks/ipc_run.h"
#include "rt/futex.h"

namespace wasp::bench {
namespace {

struct Page {
  alignas(64) std::atomic<std::uint32_t> sequence{0};
  FrameHeader head;
  std::array<std::byte, kFrameBytes> frame;
};

struct Means {
  Page* page = nullptr;
  int event_fd = -1;
  int pipe_out = -1, pipe_in = -1;
};
Means means;

void drain(int fd) {
  std::vector<std::byte> sink(1 << 16);
  pollfd waiting{fd, POLLIN, 0};
  while (poll(&waiting, 1, 0) > 0 && read(fd, sink.data(), sink.size()) > 0) {
  }
}

/// Writes into the page; `Wake` is the way to wake.
template <class Wake>
struct PageWriter {
  std::byte* loan() noexcept { return means.page->frame.data(); }
  void before_copy(Before) noexcept {}
  void publish(TimeNs) noexcept {
    std::memcpy(&means.page->head, means.page->frame.data(), sizeof(FrameHeader));
    means.page->sequence.store(means.page->head.sequence, std::memory_order_release);
    Wake::wake();
  }
};
template <class Wake>
struct PageReader {
  bool wait() noexcept {
    Wake::wait(last);
    return means.page->sequence.load(std::memory_order_acquire) != last;
  }
  bool take(FrameHeader& head) noexcept {
    const std::uint32_t now = means.page->sequence.load(std::memory_order_acquire);
    if (now == last) return false;
    std::memcpy(&head, &means.page->head, sizeof head);
    last = now;
    return true;
  }
  std::uint32_t last = 0;
};

struct Futex {
  static void wake() noexcept { rt::futex_wake_all(&means.page->sequence); }
  static void wait(std::uint32_t last) noexcept {
    rt::futex_wait_until(&means.page->sequence, last, rt::now() + 100 * kMillisecond);
  }
};

struct Eventfd {
  static void wake() noexcept {
    const std::uint64_t one = 1;
    if (write(means.event_fd, &one, sizeof one) < 0) return;
  }
  static void wait(std::uint32_t) noexcept {
    pollfd waiting{means.event_fd, POLLIN, 0};
    std::uint64_t count = 0;
    if (poll(&waiting, 1, 100) > 0 && read(means.event_fd, &count, sizeof count) < 0) return;
  }
};

class PipeWriter {
 public:
  std::byte* loan() noexcept { return frame_.data(); }
  void before_copy(Before) noexcept {}
  void publish(TimeNs) noexcept {
    for (std::size_t done = 0; done < frame_.size();) {
      const ssize_t n = write(means.pipe_in, frame_.data() + done, frame_.size() - done);
      if (n <= 0) return;
      done += static_cast<std::size_t>(n);
    }
  }

 private:
  std::vector<std::byte> frame_ = std::vector<std::byte>(kFrameBytes);
};

/// The frame is in hand when its last byte is.
class PipeReader {
 public:
  bool wait() noexcept {
    pollfd waiting{means.pipe_out, POLLIN, 0};
    return poll(&waiting, 1, 100) > 0;
  }
  bool take(FrameHeader& head) noexcept {
    pollfd waiting{means.pipe_out, POLLIN, 0};
    if (poll(&waiting, 1, 0) <= 0) return false;
    for (std::size_t done = 0; done < frame_.size();) {
      const ssize_t n = read(means.pipe_out, frame_.data() + done, frame_.size() - done);
      if (n <= 0) return false;
      done += static_cast<std::size_t>(n);
    }
    std::memcpy(&head, frame_.data(), sizeof head);
    return true;
  }

 private:
  std::vector<std::byte> frame_ = std::vector<std::byte>(kFrameBytes);
};

template <class Writer>
int write_with(Run& run) {
  Writer writer;
  return write_frames(writer, run);
}
template <class Reader>
int read_with(Run& run) {
  means.page->sequence = 0;
  drain(means.pipe_out);
  Reader reader;
  return read_frames(reader, run);
}

}  // namespace

void open_kernel_means() {
  void* memory = mmap(nullptr, sizeof(Page), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  int ends[2];
  means.event_fd = eventfd(0, EFD_CLOEXEC);
  if (memory == MAP_FAILED || pipe2(ends, O_CLOEXEC) != 0 || means.event_fd < 0)
    throw std::runtime_error("no shared page, pipe or eventfd");
  means.page = new (memory) Page;
  means.pipe_out = ends[0];
  means.pipe_in = ends[1];
  fcntl(means.pipe_in, F_SETPIPE_SZ, 1 << 20);  // two whole frames: the writer need not wait for the reader
}

int futex_writer(const std::string&, Run& run) { return write_with<PageWriter<Futex>>(run); }
int futex_reader(const std::string&, Run& run) { return read_with<PageReader<Futex>>(run); }
int eventfd_writer(const std::string&, Run& run) { return write_with<PageWriter<Eventfd>>(run); }
int eventfd_reader(const std::string&, Run& run) { return read_with<PageReader<Eventfd>>(run); }
int pipe_writer(const std::string&, Run& run) { return write_with<PipeWriter>(run); }
int pipe_reader(const std::string&, Run& run) { return read_with<PipeReader>(run); }

}  // namespace wasp::bench
