// The reader's end of a frame ring: sleeps for a frame, checks its header, gives views into the slot.
#pragma once

#include "shm/broadcast_ring.h"
#include "types/behaviour.h"

namespace wasp::scheduling {

/// A frame in place; the views are valid until `FrameSource::intact` says no.
struct Frame {
  shm::Sample sample;
  FrameHeader header;
  GrayView gray;
  DepthView depth;
  explicit operator bool() const noexcept { return static_cast<bool>(sample); }
};

class FrameSource {
 public:
  FrameSource(const shm::Region& region, Stream stream)
      : reader_(region, stream == Stream::kDepth ? "depth" : "gray", "Frame"), stream_(stream) {}

  /// Frames overwritten before or during use, and frames whose header was not believable.
  [[nodiscard]] std::uint64_t lost() const noexcept { return reader_.lost(); }
  [[nodiscard]] std::uint64_t malformed() const noexcept { return malformed_; }
  void from_the_start() noexcept { reader_.rewind(); }

  /// The newest unread frame (`in_order` false) or the oldest unread (true); empty on time-out. Realtime-safe: yes.
  Frame wait(TimeNs deadline_ns, bool in_order) WASP_REALTIME {
    if (!reader_.wait(deadline_ns)) return {};
    Frame frame;
    frame.sample = in_order ? reader_.next() : reader_.latest();
    if (!frame.sample) return {};
    __builtin_memcpy(&frame.header, frame.sample.data, sizeof frame.header);
    if (!reader_.intact(frame.sample)) {
      reader_.count_lost();
      return {};
    }
    if (!believable(frame.header)) {
      ++malformed_;
      return {};
    }
    const auto* pixels = frame.sample.data + kFramePixelOffset;
    const auto& h = frame.header;
    const int width = static_cast<int>(h.width_px), height = static_cast<int>(h.height_px);
    if (stream_ == Stream::kDepth)
      frame.depth = {reinterpret_cast<const std::uint16_t*>(pixels), width, height,
                     static_cast<int>(h.stride_bytes / 2)};
    else
      frame.gray = {reinterpret_cast<const std::uint8_t*>(pixels), width, height, static_cast<int>(h.stride_bytes)};
    return frame;
  }
  /// After the last use of the views: true if nothing was overwritten. Counts it otherwise. Realtime-safe: yes.
  bool intact(const Frame& frame) WASP_REALTIME {
    const bool ok = reader_.intact(frame.sample);
    if (!ok) reader_.count_lost();
    return ok;
  }

 private:
  [[nodiscard]] bool believable(const FrameHeader& h) const noexcept {
    const std::uint32_t pixel_bytes = stream_ == Stream::kDepth ? 2 : 1;
    const PixelFormat format = stream_ == Stream::kDepth ? PixelFormat::kDepth16Mm : PixelFormat::kMono8;
    return h.format == format && h.width_px > 0 && h.height_px > 0 && h.width_px <= 16384 && h.height_px <= 16384 &&
           h.stride_bytes >= h.width_px * pixel_bytes && h.stride_bytes % pixel_bytes == 0 &&
           static_cast<std::uint64_t>(h.stride_bytes) * h.height_px <= reader_.payload_bytes() - kFramePixelOffset;
  }
  shm::RingReader reader_;
  Stream stream_;
  std::uint64_t malformed_ = 0;
};

/// The newest attitude not after `at_ns` in the ring's history; false if there is none. Bounded by the ring's length.
/// Realtime-safe: yes.
inline bool attitude_at(const shm::RingReader& ring, TimeNs at_ns, AttitudeSample& out) WASP_REALTIME {
  const std::uint64_t newest = ring.newest();
  for (std::uint64_t n = newest; n > 0 && newest - n < ring.slots() - 1u; --n)
    if (ring.copy(n, out) && out.exposed_at_ns <= at_ns) return true;
  return false;
}

}  // namespace wasp::scheduling
