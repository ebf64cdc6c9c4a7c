// The reader's end of the ring that releases a behaviour: sleeps for a message, judges it (frame_judge.h), gives views
// into the slot - of a frame, of a frame and the depth frame of the same exposure, or of a flow field.
#pragma once

#include <optional>

#include "rt/clock.h"
#include "scheduling/flow_ring.h"
#include "scheduling/frame_judge.h"
#include "scheduling/image_hash.h"
#include "scheduling/stream_ring.h"

namespace wasp::scheduling {

/// What released a step, in place; the views are valid until `FrameSource::intact` says no.
struct Frame {
  shm::Sample sample;
  shm::Sample depth_sample;  ///< kGrayDepth: where its depth lies; empty if that frame is missing
  TimeNs shown_at_ns = 0;    ///< exposure, by the clock of this flight
  TimeNs exposed_at_ns = 0;  ///< what the step is told: of a flow field in a replay, the recording's time
  std::uint32_t sequence = 0;
  GrayView gray;
  DepthView depth;
  const FlowMessage* flow = nullptr;
  explicit operator bool() const noexcept { return static_cast<bool>(sample); }
};

class FrameSource {
 public:
  /// Throws if the ring of the stream is absent or of another type.
  FrameSource(const shm::Region& camera, const shm::Region& flight, Stream stream, const FrameRules& rules = {})
      : reader_(is_flow(stream) ? flight : camera, ring_of(stream), type_of(stream)), stream_(stream), judge_(rules) {
    if (stream == Stream::kGrayDepth && camera.has(shm::kDepth)) depth_.emplace(camera, shm::kDepth, "Frame");
  }

  /// Messages overwritten before or during use.
  [[nodiscard]] std::uint64_t lost() const noexcept { return reader_.lost(); }
  /// Messages refused, by kind.
  [[nodiscard]] const FrameCounts& counts() const noexcept { return judge_.counts(); }
  void from_the_start() noexcept { reader_.rewind(); }

  /// The newest unread message (`in_order` false) or the oldest unread (true); empty on time-out, and if what came was
  /// refused. Realtime-safe: yes.
  Frame wait(TimeNs deadline_ns, bool in_order) WASP_REALTIME {
    if (!reader_.wait(deadline_ns)) return {};
    Frame frame;
    frame.sample = in_order ? reader_.next() : reader_.latest();
    if (!frame.sample) return {};
    const bool good = is_flow(stream_) ? take_flow(frame) : take_pixels(frame);
    const std::uint64_t image = good ? hash_of(frame) : 0;
    if (!reader_.intact(frame.sample)) {
      reader_.count_lost();
      return {};
    }
    if (!good) {
      judge_.note_malformed();
      return {};
    }
    if (judge_.judge({frame.sequence, frame.shown_at_ns, image}, rt::now()) != FrameFault::kNone) return {};
    if (depth_) find_depth(frame);
    return frame;
  }
  /// After the last use of the views: true if nothing was overwritten. Counts it otherwise. Realtime-safe: yes.
  bool intact(const Frame& frame) WASP_REALTIME {
    const bool ok = reader_.intact(frame.sample) && (!frame.depth_sample || depth_->intact(frame.depth_sample));
    if (!ok) reader_.count_lost();
    return ok;
  }

 private:
  static DepthView depth_view(const std::byte* slot, const FrameHeader& h) WASP_REALTIME {
    return {reinterpret_cast<const std::uint16_t*>(slot + kFramePixelOffset), static_cast<int>(h.width_px),
            static_cast<int>(h.height_px), static_cast<int>(h.stride_bytes / 2)};
  }

  static bool believable_frame(const FrameHeader& h, PixelFormat format, std::uint64_t payload_bytes) WASP_REALTIME {
    const std::uint32_t pixel_bytes = format == PixelFormat::kDepth16Mm ? 2 : 1;
    return h.format == format && h.width_px > 0 && h.height_px > 0 && h.width_px <= 16384 && h.height_px <= 16384 &&
           h.stride_bytes >= h.width_px * pixel_bytes && h.stride_bytes % pixel_bytes == 0 &&
           static_cast<std::uint64_t>(h.stride_bytes) * h.height_px <= payload_bytes - kFramePixelOffset;
  }

  /// Of the configured size; rows close together, or as far apart as the slot the camera reserved for them.
  [[nodiscard]] bool as_promised(const FrameHeader& h, std::uint64_t payload_bytes) const WASP_REALTIME {
    const FrameRules& rules = judge_.rules();
    const std::uint32_t tight = h.width_px * (h.format == PixelFormat::kDepth16Mm ? 2 : 1);
    if (rules.width_px == 0) return true;
    return h.width_px == rules.width_px && h.height_px == rules.height_px &&
           (h.stride_bytes == tight || h.stride_bytes == (payload_bytes - kFramePixelOffset) / h.height_px);
  }

  /// 0 where images are not compared.
  [[nodiscard]] std::uint64_t hash_of(const Frame& frame) const WASP_REALTIME {
    if (judge_.rules().stuck_frames == 0) return 0;
    return stream_ == Stream::kDepth ? image_hash(frame.depth) : image_hash(frame.gray);
  }

  bool take_pixels(Frame& frame) const WASP_REALTIME {
    FrameHeader h;
    __builtin_memcpy(&h, frame.sample.data, sizeof h);
    const bool depth = stream_ == Stream::kDepth;
    if (!believable_frame(h, depth ? PixelFormat::kDepth16Mm : PixelFormat::kMono8, reader_.payload_bytes()) ||
        !as_promised(h, reader_.payload_bytes()))
      return false;
    frame.shown_at_ns = frame.exposed_at_ns = h.exposed_at_ns;
    frame.sequence = h.sequence;
    if (depth)
      frame.depth = depth_view(frame.sample.data, h);
    else
      frame.gray = {reinterpret_cast<const std::uint8_t*>(frame.sample.data + kFramePixelOffset),
                    static_cast<int>(h.width_px), static_cast<int>(h.height_px), static_cast<int>(h.stride_bytes)};
    return true;
  }

  bool take_flow(Frame& frame) const WASP_REALTIME {
    if (reader_.payload_bytes() < sizeof(FlowSlot)) return false;
    const auto* slot = reinterpret_cast<const FlowSlot*>(frame.sample.data);
    frame.shown_at_ns = slot->shown_at_ns;
    frame.exposed_at_ns = slot->message.exposed_at_ns;
    frame.sequence = slot->message.frame_sequence;
    frame.flow = &slot->message;
    return believable(slot->message.seen) && believable(slot->message.still);
  }

  /// The camera publishes depth before the grey frame of the same exposure, so what belongs to it is there already.
  void find_depth(Frame& frame) WASP_REALTIME {
    const std::uint64_t newest = depth_->newest();
    for (std::uint64_t n = newest; n > 0 && newest - n < depth_->slots() - 1u; --n) {
      const shm::Sample sample = depth_->look(n);
      if (!sample) continue;
      FrameHeader h;
      __builtin_memcpy(&h, sample.data, sizeof h);
      if (!depth_->intact(sample) || h.sequence != frame.sequence || h.exposed_at_ns != frame.exposed_at_ns) continue;
      if (!believable_frame(h, PixelFormat::kDepth16Mm, depth_->payload_bytes()) ||
          !as_promised(h, depth_->payload_bytes()))
        return judge_.note_malformed();
      const DepthView view = depth_view(sample.data, h);
      const std::uint64_t image = judge_.rules().stuck_frames == 0 ? 0 : image_hash(view);
      if (!depth_->intact(sample) || !judge_.depth_is_new(image)) return;
      frame.depth_sample = sample;
      frame.depth = view;
      return;
    }
  }

  shm::RingReader reader_;
  std::optional<shm::RingReader> depth_;
  Stream stream_;
  FrameJudge judge_;
};

}  // namespace wasp::scheduling
