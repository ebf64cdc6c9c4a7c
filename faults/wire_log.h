// What went over the serial line, in order, with the time of each piece: as either side wrote it, before any fault.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "types/time.h"

namespace wasp::faults {

enum class Direction : std::uint8_t { kToAutopilot = 0, kToFlight = 1 };

/// One read from the line.
struct WireChunk {
  TimeNs at_ns = 0;  ///< read from the line
  Direction direction = Direction::kToAutopilot;
  std::vector<std::uint8_t> bytes;
};

/// One writer, readers on any thread; nobody waits for anybody: the writer is a real-time thread, its readers are not.
class WireLog {
 public:
  /// False, and nothing kept, when it is full: some hours of a flight.
  bool add(TimeNs at_ns, Direction direction, std::span<const std::uint8_t> bytes) {
    const std::size_t n = size_.load(std::memory_order_relaxed);
    if (n >= kBlocks * kBlock) return false;
    auto& block = blocks_[n / kBlock];
    if (!block) block = std::make_unique<Block>();
    (*block)[n % kBlock] = {at_ns, direction, {bytes.begin(), bytes.end()}};
    size_.store(n + 1, std::memory_order_release);
    return true;
  }
  [[nodiscard]] std::size_t size() const { return size_.load(std::memory_order_acquire); }
  /// Chunk `n` < size(); it never changes and never moves.
  [[nodiscard]] const WireChunk& at(std::size_t n) const { return (*blocks_[n / kBlock])[n % kBlock]; }

 private:
  static constexpr std::size_t kBlock = 1024, kBlocks = 8192;
  using Block = std::array<WireChunk, kBlock>;
  std::atomic<std::size_t> size_{0};
  std::vector<std::unique_ptr<Block>> blocks_ = std::vector<std::unique_ptr<Block>>(kBlocks);
};

}  // namespace wasp::faults
