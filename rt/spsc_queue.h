// Bounded queue between two threads: one producer, one consumer, wait-free both ways. Full means push returns false.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>

#include "rt/contract.h"

namespace wasp::rt {

template <class T, std::size_t Capacity>
class SpscQueue {
  static_assert(Capacity > 0 && (Capacity & (Capacity - 1)) == 0, "capacity must be a power of two");

 public:
  /// Producer only. Realtime-safe: yes if T's copy is.
  bool push(const T& value) WASP_REALTIME {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == Capacity) return false;
    items_[tail % Capacity] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  /// Consumer only. Realtime-safe: yes if T's copy is.
  bool pop(T& value) WASP_REALTIME {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return false;
    value = items_[head % Capacity];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

 private:
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
  alignas(64) std::array<T, Capacity> items_{};
};

}  // namespace wasp::rt
