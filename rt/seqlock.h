// Latest value: one writer, any readers. The writer never waits; a reader retries while a write is under way, a bounded
// number of times. (Boehm, "Can seqlocks get along with programming language memory models?", MSPC 2012.)
#pragma once

#include <atomic>
#include <cstdint>

#include "rt/word_copy.h"

namespace wasp::rt {

template <WordCopyable T>
class Seqlock {
 public:
  /// One writer only. Realtime-safe: yes, wait-free.
  void store(const T& value) WASP_REALTIME {
    // `| 1` and not `+ 1`: a writer that died in mid-store left the word odd, and its successor must find its feet.
    const std::uint64_t busy = sequence_.load(std::memory_order_relaxed) | 1;
    sequence_.store(busy, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    store_words(&value_, value);
    sequence_.store(busy + 1, std::memory_order_release);
  }

  /// False if nothing was ever stored, or the writer was busy on each of `attempts` looks. Realtime-safe: yes.
  bool load(T& value, int attempts = 16) const WASP_REALTIME {
    for (int i = 0; i < attempts; ++i) {
      const std::uint64_t before = sequence_.load(std::memory_order_acquire);
      if (before == 0) return false;
      if ((before & 1) != 0) continue;
      load_words(value, &value_);
      std::atomic_thread_fence(std::memory_order_acquire);
      if (sequence_.load(std::memory_order_relaxed) == before) return true;
    }
    return false;
  }

 private:
  std::atomic<std::uint64_t> sequence_{0};
  T value_{};
};

}  // namespace wasp::rt
