// One block of frames from a writer process to a reader process. The two loops are written once, for any transport, so
// that wasp and iceoryx are timed by the same lines: the clock starts after the pixels are in the loan, just before
// publish, and stops when the reader has the frame's header in hand.
//
//   woken     the reader sleeps (bell, WaitSet, ...) and is woken for each frame
//   polled    the reader looks exactly once for each publish, told by a word apart that the publish has returned
//   spinning  the reader looks without pause; it may see the frame before publish returns
#pragma once

#include <sched.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <vector>

#include "rt/clock.h"
#include "rt/periodic.h"
#include "types/messages.h"

namespace wasp::bench {

enum class Mode { kWoken, kPolled, kSpinning };

/// What a wasp writer does before it copies the pixels.
enum class Before {
  kNothing,
  kAnnounce,  ///< wakes the reader, which stays awake for the copy (at most Bell::kAnnounceSpin): what our cameras do
  kRing,      ///< wakes the reader, which finds nothing and sleeps again
};

inline constexpr std::size_t kPixels = 640 * 480;
inline constexpr std::size_t kFrameBytes = kFramePixelOffset + kPixels;
inline constexpr std::size_t kMaxFrames = 200'000;
inline constexpr std::uint32_t kWarmUp = 50;

/// Shared between parent, writer and reader.
struct Run {
  Mode mode = Mode::kWoken;
  Before before = Before::kNothing;
  std::uint32_t frames = 0;  ///< to publish, warm-up included
  std::uint32_t warm_up = kWarmUp;
  DurationNs period_ns = 500 * kMicrosecond;
  bool yields = false;  ///< one core: a spinning reader must let the writer run
  std::atomic<std::uint32_t> reader_ready{0};
  std::atomic<std::uint32_t> finished{0};
  alignas(64) std::atomic<std::uint32_t> told{0};  ///< sequence of the newest frame whose publish has returned
  alignas(64) std::atomic<TimeNs> next_due_ns{0};  ///< so that a polling reader need not spin all the time
  alignas(64) std::uint32_t received = 0, written = 0;
  std::atomic<std::uint64_t> lost{0};        ///< frames a reader missed
  std::atomic<DurationNs> reader_cpu_ns{0};  ///< processor time of the reader, start-up left out
  std::array<std::int64_t, kMaxFrames> latency_ns;
  std::array<std::int64_t, kMaxFrames> publish_ns;  ///< publish alone
  std::array<std::int64_t, kMaxFrames> frame_ns;    ///< loan, 307 200 bytes, publish
};

/// `Writer`: std::byte* loan(); void before_copy(Before); void publish(TimeNs).
template <class Writer>
int write_frames(Writer& writer, Run& run) {
  const std::vector<unsigned char> image(kPixels, 7);
  while (run.reader_ready.load() == 0) rt::sleep_until(rt::now() + kMillisecond);
  rt::sleep_until(rt::now() + 20 * kMillisecond);
  rt::PeriodicGrid grid(rt::now() + kMillisecond, run.period_ns);
  for (std::uint32_t sequence = 1; sequence <= run.frames; ++sequence) {
    const rt::Release release = grid.next(rt::now());
    run.next_due_ns.store(release.due_at_ns, std::memory_order_relaxed);
    rt::sleep_until(release.due_at_ns);
    const TimeNs began = rt::now();
    std::byte* loan = writer.loan();
    if (loan == nullptr) return 2;
    writer.before_copy(run.before);
    std::memcpy(loan + kFramePixelOffset, image.data(), kPixels);
    FrameHeader head{
        .sequence = sequence, .format = PixelFormat::kMono8, .width_px = 640, .height_px = 480, .stride_bytes = 640};
    const TimeNs published = rt::now();
    head.exposed_at_ns = published;
    std::memcpy(loan, &head, sizeof head);
    writer.publish(published);
    const TimeNs done = rt::now();
    run.told.store(sequence, std::memory_order_release);
    if (sequence <= run.warm_up) continue;
    run.publish_ns[run.written] = done - published;
    run.frame_ns[run.written++] = done - began;
  }
  run.finished = 1;
  return 0;
}

/// Waits without sleeping until a frame beyond `last` was announced, from shortly before it is due. False at the end.
inline bool await_announcement(Run& run, std::uint32_t last) {
  rt::sleep_until(run.next_due_ns.load(std::memory_order_relaxed) - 150 * kMicrosecond);
  while (run.told.load(std::memory_order_acquire) <= last) {
    if (run.finished.load(std::memory_order_relaxed) != 0) return false;
    if (run.yields) sched_yield();
  }
  return true;
}

/// Of this process, so far.
inline DurationNs processor_time() {
  timespec ts{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &ts);
  return static_cast<DurationNs>(ts.tv_sec) * kSecond + ts.tv_nsec;
}

inline void note_received(Run& run, const FrameHeader& head) {
  const TimeNs received = rt::now();
  if (head.sequence > run.warm_up) run.latency_ns[run.received++] = received - head.exposed_at_ns;
}

/// Sleeps for the next frame, then takes all there are: a frame that came unannounced must not make the rest late.
template <class Reader>
void read_woken(Reader& reader, Run& run) {
  FrameHeader head;
  if (!reader.wait()) return;
  while (reader.take(head)) note_received(run, head);
}

/// One look for each publish; where announcements were missed, the frames they were for are passed over.
template <class Reader>
void read_polled(Reader& reader, Run& run, std::uint32_t& last) {
  if (!await_announcement(run, last)) return;
  FrameHeader head;
  const std::uint32_t announced = run.told.load(std::memory_order_acquire);
  for (; last < announced; ++last)
    if (reader.take(head) && head.sequence == announced) note_received(run, head);
}

template <class Reader>
void read_spinning(Reader& reader, Run& run) {
  FrameHeader head;
  rt::sleep_until(run.next_due_ns.load(std::memory_order_relaxed) - 150 * kMicrosecond);
  while (!reader.take(head)) {
    if (run.finished.load(std::memory_order_relaxed) != 0) return;
    if (run.yields) sched_yield();
  }
  note_received(run, head);
}

/// `Reader`: bool wait() sleeps for the next frame; bool take(FrameHeader&) looks once, without waiting, at the oldest
/// frame not yet taken, and may leave out torn ones.
template <class Reader>
int read_frames(Reader& reader, Run& run) {
  const DurationNs cpu_at_start_ns = processor_time();
  run.reader_ready = 1;
  std::uint32_t last = 0;
  while (run.finished.load(std::memory_order_relaxed) == 0) {
    if (run.mode == Mode::kPolled)
      read_polled(reader, run, last);
    else if (run.mode == Mode::kSpinning)
      read_spinning(reader, run);
    else
      read_woken(reader, run);
  }
  run.reader_cpu_ns = processor_time() - cpu_at_start_ns;
  return 0;
}

/// The two ends of each transport, to be run in a process of their own.
int wasp_writer(const std::string& region, Run& run);
int wasp_reader(const std::string& region, Run& run);
int iceoryx_writer(const std::string& name, Run& run);
int iceoryx_reader(const std::string& name, Run& run);

/// The kernel's own means, without any ring: what a wake-up costs at the least, and a frame through a pipe. Open them
/// in the parent, before the two ends are started.
void open_kernel_means();
int futex_writer(const std::string&, Run& run);
int futex_reader(const std::string&, Run& run);
int eventfd_writer(const std::string&, Run& run);
int eventfd_reader(const std::string&, Run& run);
int pipe_writer(const std::string&, Run& run);
int pipe_reader(const std::string&, Run& run);

}  // namespace wasp::bench
