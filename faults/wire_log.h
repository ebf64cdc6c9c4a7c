// What went over the serial line, in order, with the time of each piece: as either side wrote it, before any fault.
#pragma once

#include <cstdint>
#include <mutex>
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

/// One writer; readers on other threads take copies.
class WireLog {
 public:
  void add(TimeNs at_ns, Direction direction, std::span<const std::uint8_t> bytes) {
    const std::scoped_lock lock(mutex_);
    chunks_.push_back({at_ns, direction, {bytes.begin(), bytes.end()}});
  }
  /// The chunks from number `first` on.
  [[nodiscard]] std::vector<WireChunk> since(std::size_t first) const {
    const std::scoped_lock lock(mutex_);
    if (first >= chunks_.size()) return {};
    return {chunks_.begin() + static_cast<std::ptrdiff_t>(first), chunks_.end()};
  }

 private:
  mutable std::mutex mutex_;
  std::vector<WireChunk> chunks_;
};

}  // namespace wasp::faults
