// The last timing events of one thread, kept in a fixed ring so that a miss can be explained afterwards. One writer,
// wait-free; one reader copies it out once the shared freeze word stands, so that the events around a miss stay.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "rt/word_copy.h"
#include "types/time.h"

namespace wasp::rt {

enum class TraceKind : std::uint32_t { kNone, kRelease, kComputed, kWritten, kFrame, kCue, kWake, kDone };

struct TraceEvent {
  TimeNs at_ns = 0;
  TraceKind kind = TraceKind::kNone;
  std::uint32_t number = 0;  ///< tick or frame sequence, modulo 2^32
  DurationNs value_ns = 0;   ///< lateness or duration, by kind
};

class TraceRing {
 public:
  static constexpr std::size_t kEvents = 256;

  /// `frozen` is shared by all rings of a flight: while it is not 0 nothing is recorded.
  explicit TraceRing(const std::atomic<std::uint32_t>& frozen) noexcept : frozen_(frozen) {}

  /// One writer. Realtime-safe: yes, wait-free.
  void record(TimeNs at_ns, TraceKind kind, std::uint64_t number, DurationNs value_ns) WASP_REALTIME {
    if (frozen_.load(std::memory_order_relaxed) != 0) return;
    const std::uint64_t n = head_.load(std::memory_order_relaxed);
    store_words(&events_[n % kEvents], TraceEvent{at_ns, kind, static_cast<std::uint32_t>(number), value_ns});
    head_.store(n + 1, std::memory_order_release);
  }

  /// The events still there, oldest first; those the writer may have touched meanwhile are left out. Any thread.
  /// Realtime-safe: no (allocates).
  [[nodiscard]] std::vector<TraceEvent> copy() const {
    const std::uint64_t head = head_.load(std::memory_order_acquire);
    const std::uint64_t first = head > kEvents ? head - kEvents : 0;
    std::vector<TraceEvent> events(static_cast<std::size_t>(head - first));
    for (std::uint64_t n = first; n < head; ++n) load_words(events[n - first], &events_[n % kEvents]);
    std::atomic_thread_fence(std::memory_order_acquire);
    const std::uint64_t now = head_.load(std::memory_order_relaxed);
    const std::uint64_t intact_from = now + 1 > kEvents ? now + 1 - kEvents : 0;  // `now` may be under the pen
    const std::uint64_t torn = intact_from > first ? intact_from - first : 0;
    events.erase(events.begin(),
                 events.begin() + static_cast<std::ptrdiff_t>(torn < events.size() ? torn : events.size()));
    return events;
  }

 private:
  const std::atomic<std::uint32_t>& frozen_;
  alignas(64) std::atomic<std::uint64_t> head_{0};
  std::array<TraceEvent, kEvents> events_{};
};

}  // namespace wasp::rt
