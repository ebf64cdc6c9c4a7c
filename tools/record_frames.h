// Follows one frame ring: copies each frame out, checks afterwards that the writer did not touch it meanwhile, and
// hands it to the image writers. While their queue is full, frames wait in the ring; what is overwritten there is lost
// and counted.
#pragma once

#include <optional>

#include "shm/broadcast_ring.h"
#include "tools/record_image_pool.h"
#include "tools/record_topic.h"

namespace wasp::tools {

/// Width and height of the first good frame.
struct FrameSize {
  std::uint32_t width_px = 0, height_px = 0;
};

class FrameFollower {
 public:
  /// All references outlive the follower. Throws if the topic is absent or of another type.
  FrameFollower(const shm::Region& region, Start start, ImagePool& pool, ImageStream& stream, TopicCount& count);

  /// Takes what is new; true if frames are left waiting because the queue is full.
  bool drain();
  [[nodiscard]] const std::optional<FrameSize>& size() const { return size_; }

 private:
  void take(const shm::Sample& sample);

  shm::RingReader reader_;
  ImagePool& pool_;
  ImageStream& stream_;
  TopicCount& count_;
  std::uint64_t last_ = 0;
  std::optional<FrameSize> size_;
};

/// Copies the frame in a slot of `payload_bytes`, rows packed. nullopt if its header does not describe one.
std::optional<TakenFrame> copy_frame(const std::byte* slot, std::uint64_t payload_bytes);

}  // namespace wasp::tools
