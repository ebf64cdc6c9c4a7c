// The autopilot's end of whatever leads to the companion computer.
#pragma once

#include <cstdint>
#include <span>

#include "types/time.h"

namespace wasp::sim {

class CompanionLine {
 public:
  virtual ~CompanionLine() = default;
  /// Sleeps until bytes arrive or `until_ns` (CLOCK_MONOTONIC); true if there are bytes.
  virtual bool wait(TimeNs until_ns) = 0;
  /// What has arrived, possibly nothing.
  virtual std::span<const std::uint8_t> read() = 0;
  /// Sends `bytes`, whole frames, or drops them. Never waits.
  virtual void write(std::span<const std::uint8_t> bytes) = 0;
};

}  // namespace wasp::sim
