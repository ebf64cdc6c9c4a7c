// Broadcast ring: one writer, any number of readers that map it read-only. The writer loans a slot, writes straight
// into it, and publishes with one release store; it never waits and never looks at a reader. A reader checks the slot's
// sequence after use: if it was overwritten meanwhile the result is dropped and counted, never used.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstring>

#include "rt/futex.h"
#include "rt/word_copy.h"
#include "shm/region.h"
#include "shm/ring_layout.h"

namespace wasp::shm {

/// Writes one topic. Realtime-safe after construction: yes, wait-free (a futex wake only when somebody sleeps).
class RingWriter {
 public:
  /// Throws if the topic is absent, of another type, or not a ring.
  RingWriter(const Region& region, std::string_view topic, std::string_view type = {})
      : entry_(region.ring(topic, type)),
        ring_(reinterpret_cast<RingHeader*>(region.at(entry_.offset))),
        first_slot_(region.at(entry_.offset) + sizeof(RingHeader)),
        bell_(region.bell(entry_)) {}

  /// Capacity of the loaned memory [bytes].
  [[nodiscard]] std::uint64_t payload_bytes() const noexcept { return entry_.payload_bytes; }
  [[nodiscard]] std::uint64_t published() const noexcept { return ring_->published.load(std::memory_order_relaxed); }

  /// Memory of the next message, the writer's own until publish(). A loan abandoned by a crash is simply taken again.
  [[nodiscard]] std::byte* loan() WASP_REALTIME {
    const std::uint64_t n = published() + 1;
    std::byte* slot = slot_of(n);
    // Unchanged, but from here on the line is fetched back from whoever looked at it, while the message is written:
    // else publish() would wait for it.
    ring_->published.store(n - 1, std::memory_order_relaxed);
    reinterpret_cast<SlotHeader*>(slot)->sequence.store(2 * n - 1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    return slot + sizeof(SlotHeader);
  }
  /// Optional, before the last few microseconds of work on a loan: wakes sleeping readers early, so that they are awake
  /// when publish() comes. Use it only if publish() follows within Bell::kAnnounceSpin.
  void announce() WASP_REALTIME {
    if (bell_ != nullptr) bell_->announce();
  }
  /// Makes the loaned message visible and rings the bell.
  void publish(TimeNs published_at_ns) WASP_REALTIME {
    const std::uint64_t n = published() + 1;
    auto* slot = reinterpret_cast<SlotHeader*>(slot_of(n));
    __atomic_store_n(&slot->published_at_ns, published_at_ns, __ATOMIC_RELAXED);
    slot->sequence.store(2 * n, std::memory_order_release);
    ring_->published.store(n, std::memory_order_release);
    if (bell_ != nullptr) bell_->ring();
  }
  /// Publishes a small value in one go; false, and nothing published, if it does not fit the slot.
  template <rt::WordCopyable T>
  bool write(const T& value, TimeNs published_at_ns) WASP_REALTIME {
    if (sizeof(T) > entry_.payload_bytes) return false;
    rt::store_words(reinterpret_cast<T*>(loan()), value);
    publish(published_at_ns);
    return true;
  }

 private:
  [[nodiscard]] std::byte* slot_of(std::uint64_t n) const noexcept {
    return first_slot_ + (n - 1) % entry_.slots * slot_stride(entry_.payload_bytes);
  }
  TopicEntry entry_;
  RingHeader* ring_;
  std::byte* first_slot_;
  rt::Bell* bell_;
};

/// A look at one message in place. Valid only while `RingReader::intact` says so.
struct Sample {
  std::uint64_t number = 0;  ///< 0: none
  TimeNs published_at_ns = 0;
  const std::byte* data = nullptr;
  explicit operator bool() const noexcept { return number != 0; }
};

/// Reads one topic; keeps its own place, writes nothing to the region. Realtime-safe after construction: yes.
class RingReader {
 public:
  /// Starts at the newest message: the first `next` returns what comes after it. Throws as RingWriter does.
  RingReader(const Region& region, std::string_view topic, std::string_view type = {})
      : entry_(region.ring(topic, type)),
        ring_(reinterpret_cast<const RingHeader*>(region.at(entry_.offset))),
        first_slot_(region.at(entry_.offset) + sizeof(RingHeader)),
        bell_(region.bell(entry_)),
        seen_(newest()) {}

  [[nodiscard]] std::uint64_t newest() const noexcept { return ring_->published.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t payload_bytes() const noexcept { return entry_.payload_bytes; }
  [[nodiscard]] std::uint32_t slots() const noexcept { return entry_.slots; }
  /// Messages that were overwritten before or while this reader looked.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }
  /// Reads history too: the next `next` returns the oldest message still there.
  void rewind() noexcept { seen_ = newest() >= entry_.slots ? newest() - entry_.slots + 1 : 0; }

  /// Sleeps until a message newer than the last taken exists; false on time-out. Needs bells.
  bool wait(TimeNs deadline_ns) WASP_REALTIME {
    if (bell_ == nullptr) return unread();
    return bell_->wait([this]() noexcept { return unread(); }, deadline_ns);
  }
  /// True if a message newer than the last taken exists.
  [[nodiscard]] bool unread() const WASP_REALTIME { return newest() > seen_; }

  /// The oldest unread message that is still intact; skipped ones are counted as lost. Empty if there is none.
  Sample next() WASP_REALTIME {
    for (std::uint32_t i = 0; i < entry_.slots; ++i) {
      const std::uint64_t newest_number = newest();
      if (newest_number <= seen_) return {};
      std::uint64_t n = seen_ + 1;
      // Slot (newest + 1) may be under the writer's pen, so at most slots - 1 messages are safe to start on.
      if (newest_number - n >= entry_.slots - 1u) {
        const std::uint64_t oldest = newest_number - entry_.slots + 2;
        lost_ += oldest - n;
        n = oldest;
      }
      seen_ = n;
      if (const Sample sample = look(n)) return sample;
      ++lost_;  // overwritten between the two looks: try the one after it
    }
    return {};
  }
  /// The newest message, passing over older unread ones; `passed` is how many. Empty if nothing is new.
  Sample latest(std::uint64_t* passed = nullptr) WASP_REALTIME {
    const std::uint64_t last_seen = seen_;
    for (std::uint32_t i = 0; i < entry_.slots; ++i) {
      const std::uint64_t n = newest();
      if (n <= seen_) return {};
      seen_ = n;
      if (passed != nullptr) *passed = n - last_seen - 1;
      if (const Sample sample = look(n)) return sample;
      ++lost_;  // the writer lapped the whole ring between the two looks: a newer one exists
    }
    return {};
  }
  /// Message `n` if it is still there, without moving the reader's place.
  [[nodiscard]] Sample look(std::uint64_t n) const WASP_REALTIME {
    if (n == 0) return {};
    const std::byte* slot = first_slot_ + (n - 1) % entry_.slots * slot_stride(entry_.payload_bytes);
    const auto* head = reinterpret_cast<const SlotHeader*>(slot);
    if (head->sequence.load(std::memory_order_acquire) != 2 * n) return {};
    return {n, __atomic_load_n(&head->published_at_ns, __ATOMIC_RELAXED), slot + sizeof(SlotHeader)};
  }
  /// True if the sample was not touched since it was taken: call after the last use of its data.
  [[nodiscard]] bool intact(const Sample& sample) const WASP_REALTIME {
    if (!sample) return false;
    std::atomic_thread_fence(std::memory_order_acquire);
    const auto* head = reinterpret_cast<const SlotHeader*>(sample.data - sizeof(SlotHeader));
    return head->sequence.load(std::memory_order_relaxed) == 2 * sample.number;
  }
  /// Counts a sample the caller found overwritten.
  void count_lost() noexcept { ++lost_; }

  /// Copies message `n` out; false if it is gone or was torn.
  template <rt::WordCopyable T>
  bool copy(std::uint64_t n, T& out) const WASP_REALTIME {
    const Sample sample = look(n);
    if (!sample || sizeof(T) > entry_.payload_bytes) return false;
    rt::load_words(out, reinterpret_cast<const T*>(sample.data));
    return intact(sample);
  }
  /// Copies the newest message out; false if there is none. Retries while the writer laps, a bounded number of times.
  template <rt::WordCopyable T>
  bool copy_newest(T& out) const WASP_REALTIME {
    for (int i = 0; i < 8; ++i)
      if (const std::uint64_t n = newest(); n == 0 || copy(n, out)) return n != 0;
    return false;
  }
  /// Copies the next unread message out; false if there is none.
  template <rt::WordCopyable T>
  bool read(T& out) WASP_REALTIME {
    for (std::uint32_t i = 0; i < entry_.slots; ++i) {
      const Sample sample = next();
      if (!sample && newest() <= seen_) return false;
      if (sample && sizeof(T) <= entry_.payload_bytes) {
        rt::load_words(out, reinterpret_cast<const T*>(sample.data));
        if (intact(sample)) return true;
        ++lost_;
      }
    }
    return false;
  }

 private:
  TopicEntry entry_;
  const RingHeader* ring_;
  const std::byte* first_slot_;
  rt::Bell* bell_;
  std::uint64_t seen_;
  std::uint64_t lost_ = 0;
};

}  // namespace wasp::shm
