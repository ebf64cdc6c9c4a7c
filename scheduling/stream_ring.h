// Which ring releases a stream, and in which region it lies.
#pragma once

#include "shm/topics.h"
#include "types/behaviour.h"

namespace wasp::scheduling {

/// Topic of the ring whose messages release a behaviour of this stream: in the flight region for flow, else in the
/// camera's.
constexpr const char* ring_of(Stream stream) noexcept {
  switch (stream) {
    case Stream::kGray:
    case Stream::kGrayDepth:
      return shm::kGray;
    case Stream::kDepth:
      return shm::kDepth;
    case Stream::kDown:
      return shm::kGrayDown;
    case Stream::kFlow:
      return shm::kFlow;
    case Stream::kFlowDown:
      return shm::kFlowDown;
  }
  return "";
}

constexpr const char* type_of(Stream stream) noexcept { return is_flow(stream) ? "Flow" : "Frame"; }

}  // namespace wasp::scheduling
