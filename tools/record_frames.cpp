#include "tools/record_frames.h"

#include <cstring>

namespace wasp::tools {
namespace {

std::uint64_t bytes_per_pixel(PixelFormat format) {
  return format == PixelFormat::kMono8 ? 1 : format == PixelFormat::kDepth16Mm ? 2 : 0;
}

bool describes_a_frame(const FrameHeader& h, std::uint64_t payload_bytes) {
  const std::uint64_t row = h.width_px * bytes_per_pixel(h.format);
  return row > 0 && h.height_px > 0 && h.stride_bytes >= row && payload_bytes >= kFramePixelOffset &&
         h.stride_bytes * (h.height_px - 1ull) + row <= payload_bytes - kFramePixelOffset && h.exposed_at_ns >= 0;
}

}  // namespace

std::optional<TakenFrame> copy_frame(const std::byte* slot, std::uint64_t payload_bytes) {
  TakenFrame frame;
  std::memcpy(&frame.header, slot, sizeof frame.header);
  const FrameHeader& h = frame.header;
  if (!describes_a_frame(h, payload_bytes)) return std::nullopt;
  const std::size_t row = h.width_px * bytes_per_pixel(h.format);
  frame.pixels.resize(row * h.height_px);
  for (std::size_t v = 0; v < h.height_px; ++v)
    std::memcpy(frame.pixels.data() + v * row, slot + kFramePixelOffset + v * h.stride_bytes, row);
  return frame;
}

FrameFollower::FrameFollower(const shm::Region& region, Start start, ImagePool& pool, ImageStream& stream,
                             TopicCount& count)
    : reader_(region, count.topic, count.type), pool_(pool), stream_(stream), count_(count) {
  start_reader(reader_, start, count_);
  last_ = start == Start::kNewest ? reader_.newest() : 0;
}

bool FrameFollower::drain() {
  const std::uint64_t lost_before = reader_.lost();
  bool waiting = false;
  for (std::uint32_t i = 0; i < 2 * reader_.slots(); ++i) {
    waiting = reader_.newest() > last_ && !pool_.has_room();
    if (waiting) {
      ++count_.queue_full;
      break;
    }
    const std::uint64_t lost = reader_.lost();
    const shm::Sample sample = reader_.next();
    if (sample)
      take(sample);
    else if (reader_.lost() == lost)
      break;
  }
  count_.lost += reader_.lost() - lost_before;
  return waiting;
}

void FrameFollower::take(const shm::Sample& sample) {
  last_ = sample.number;
  auto frame = copy_frame(sample.data, reader_.payload_bytes());
  if (!reader_.intact(sample)) return reader_.count_lost();
  if (!frame) {
    ++count_.rejected;
    return;
  }
  if (!size_) size_ = FrameSize{frame->header.width_px, frame->header.height_px};
  pool_.push(stream_, std::move(*frame));
  ++count_.taken;
}

}  // namespace wasp::tools
