// Decoded frames on their way from the decoder (ordinary thread) to the replay camera (real-time thread): a fixed pool,
// handed back and forth by index through two wait-free queues.
#pragma once

#include <cstdint>
#include <vector>

#include "rt/spsc_queue.h"
#include "types/time.h"

namespace wasp::scheduling {

struct DecodedFrame {
  DurationNs offset_ns = 0;  ///< due this long after the start of the replay
  std::uint32_t sequence = 0;
  bool has_depth = false, has_gray = false;
  std::vector<std::uint16_t> depth_mm;
  std::vector<std::uint8_t> gray;
};

class FramePool {
 public:
  static constexpr std::size_t kFrames = 16;

  /// Allocates all pixels; start-up only.
  FramePool(std::size_t depth_pixels, std::size_t gray_pixels) : frames_(kFrames) {
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      frames_[i].depth_mm.resize(depth_pixels);
      frames_[i].gray.resize(gray_pixels);
      empty_.push(i);
    }
  }
  DecodedFrame& frame(std::uint32_t index) { return frames_[index]; }
  bool take_empty(std::uint32_t& index) { return empty_.pop(index); }              ///< decoder
  void give_full(std::uint32_t index) { full_.push(index); }                       ///< decoder
  bool take_full(std::uint32_t& index) WASP_REALTIME { return full_.pop(index); }  ///< camera
  void give_empty(std::uint32_t index) WASP_REALTIME { empty_.push(index); }       ///< camera

 private:
  std::vector<DecodedFrame> frames_;
  rt::SpscQueue<std::uint32_t, kFrames> empty_, full_;
};

}  // namespace wasp::scheduling
