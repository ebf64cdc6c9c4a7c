// The image.* and depth.* points on the frames of one ring, with what they need of earlier frames.
#pragma once

#include <vector>

#include "scheduling/camera_fate.h"
#include "scheduling/frame_faults.h"

namespace wasp::scheduling {

class PixelFaults {
 public:
  /// Start-up: room for frames of `bytes`.
  explicit PixelFaults(std::uint64_t bytes);
  /// `frame`: header and pixels; `before`: the frame before in its ring, or null. Realtime-safe: yes.
  void corrupt(std::byte* frame, const std::byte* before, const Fate& fate, const FaultBoard& board) WASP_REALTIME;

 private:
  void freeze(std::byte* frame, bool on) WASP_REALTIME;
  void corrupt_gray(std::byte* frame, const std::byte* before, const Fate& fate, const FaultBoard& board) WASP_REALTIME;
  void corrupt_depth(std::byte* frame, const Fate& fate, const FaultBoard& board) WASP_REALTIME;

  std::uint64_t bytes_;
  std::vector<std::byte> frozen_, before_;
  std::vector<std::uint8_t> scratch_;
  std::vector<std::uint32_t> columns_;
  bool is_frozen_ = false;
  FaultRandom random_;
};

}  // namespace wasp::scheduling
