// How a broadcast ring lies in memory.
#pragma once

#include <atomic>
#include <cstdint>

#include "types/time.h"

namespace wasp::shm {

/// Messages are numbered from 1. Message n lies in slot (n - 1) % slots.
struct alignas(64) RingHeader {
  std::atomic<std::uint64_t> published;  ///< number of the newest complete message, 0: none yet
};

/// Sequence word: 2n - 1 while message n is being written, 2n once it is complete.
struct alignas(64) SlotHeader {
  std::atomic<std::uint64_t> sequence;
  TimeNs published_at_ns;
};
static_assert(sizeof(RingHeader) == 64 && sizeof(SlotHeader) == 64);

constexpr std::uint64_t slot_stride(std::uint64_t payload_bytes) { return sizeof(SlotHeader) + payload_bytes; }

}  // namespace wasp::shm
