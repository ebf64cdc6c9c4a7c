#include "scheduling/pixel_faults.h"

#include <cstring>

namespace wasp::scheduling {

using enum FaultPoint;

PixelFaults::PixelFaults(std::uint64_t bytes)
    : bytes_(bytes), frozen_(bytes), before_(bytes), scratch_(bytes), columns_(16384) {}

/// Pixels of the first frame in place of all that follow; its header does not stay.
void PixelFaults::freeze(std::byte* frame, bool on) WASP_REALTIME {
  const std::uint64_t count = bytes_ - kFramePixelOffset;
  if (on && is_frozen_) std::memcpy(frame + kFramePixelOffset, frozen_.data() + kFramePixelOffset, count);
  if (on && !is_frozen_) std::memcpy(frozen_.data(), frame, bytes_);
  is_frozen_ = on;
}

void PixelFaults::corrupt(std::byte* frame, const std::byte* before, const Fate& fate,
                          const FaultBoard& board) WASP_REALTIME {
  const bool depth = depth_pixels(frame, bytes_).valid();
  freeze(frame, fate.has(kCameraFreeze) || (depth && fate.has(kDepthFreeze)));
  if (depth)
    corrupt_depth(frame, fate, board);
  else
    corrupt_gray(frame, before, fate, board);
}

void PixelFaults::corrupt_gray(std::byte* frame, const std::byte* before, const Fate& fate,
                               const FaultBoard& board) WASP_REALTIME {
  const GrayPixels image = gray_pixels(frame, bytes_);
  if (!image.valid()) return;
  if (fate.has(kImageTear) && before != nullptr) {
    std::memcpy(before_.data(), before, bytes_);
    tear(image, gray_pixels(before_.data(), bytes_), board.value(kImageTear));
  }
  if (fate.has(kImageGain)) multiply(image, board.value(kImageGain));
  if (fate.has(kImageBlur)) blur_gray(image, static_cast<int>(board.value(kImageBlur)), scratch_, columns_);
  if (fate.has(kImageNoise)) add_noise(image, board.value(kImageNoise), random_);
  if (fate.has(kImageBand)) kill_band(image, board.value(kImageBand));
  for (const FaultPoint level : {kImageBlack, kImageWhite})
    if (fate.has(level)) fill_gray(image, board.value(level));
}

void PixelFaults::corrupt_depth(std::byte* frame, const Fate& fate, const FaultBoard& board) WASP_REALTIME {
  const DepthPixels image = depth_pixels(frame, bytes_);
  if (fate.has(kDepthBias)) add_bias(image, board.value(kDepthBias));
  if (fate.has(kDepthNoise)) add_noise(image, board.value(kDepthNoise), random_);
  if (fate.has(kDepthQuantise)) quantise(image, board.value(kDepthQuantise));
  if (fate.has(kDepthZero)) fill_depth(image, board.value(kDepthZero), false);
  if (fate.has(kDepthFar)) fill_depth(image, board.value(kDepthFar), true);
  if (fate.has(kDepthHoles)) make_holes(image, board.value(kDepthHoles), random_);
  if (fate.has(kDepthNone)) make_holes(image, 1.f, random_);
}

}  // namespace wasp::scheduling
