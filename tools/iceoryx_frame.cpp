#include "tools/iceoryx_frame.h"

#include <cstring>
#include <string_view>

namespace wasp::iceoryx {
namespace {

constexpr std::uint32_t kMaxSide = 16384;  // as scheduling/frame_source.h believes

std::string number(std::uint64_t n) { return std::to_string(n); }

std::string judge_header(const FrameHeader& h, std::uint64_t bytes) {
  const std::uint32_t pixel = pixel_bytes(h.format);
  const std::string size = number(h.width_px) + "x" + number(h.height_px);
  if (pixel == 0) return "pixel format " + number(static_cast<std::uint32_t>(h.format)) + " is not known";
  if (h.width_px == 0 || h.height_px == 0 || h.width_px > kMaxSide || h.height_px > kMaxSide)
    return "impossible size " + size;
  if (h.stride_bytes < h.width_px * pixel || h.stride_bytes % pixel != 0)
    return "impossible stride of " + number(h.stride_bytes) + " bytes for " + size + " " + format_name(h.format);
  const std::uint64_t needed = static_cast<std::uint64_t>(h.stride_bytes) * h.height_px;
  if (bytes < needed)
    return "wrong size: " + size + " " + format_name(h.format) + " needs " + number(needed) +
           " bytes of pixels, the message holds " + number(bytes);
  return {};
}

}  // namespace

std::string read_frame(const void* chunk, std::uint64_t bytes, FrameView& frame) {
  MessageHead head;
  if (bytes < sizeof head) return "wrong size: " + number(bytes) + " bytes cannot hold the head of a message";
  std::memcpy(&head, chunk, sizeof head);
  if (head.magic != kMessageMagic) return "not a message of wasp (for bare pixels say --raw)";
  if (head.version != kMessageVersion)
    return "message version " + number(head.version) + ", this program reads " + number(kMessageVersion);
  const std::string_view type(head.type.data(), strnlen(head.type.data(), head.type.size()));
  if (type != "Frame") return "it holds '" + std::string(type) + "', not a Frame";
  if (head.payload_bytes > bytes - sizeof head || head.payload_bytes < kFramePixelOffset)
    return "wrong size: the head speaks of " + number(head.payload_bytes) + " bytes, " + number(bytes - sizeof head) +
           " follow it";
  const auto* payload = static_cast<const std::byte*>(chunk) + sizeof head;
  std::memcpy(&frame.header, payload, sizeof frame.header);
  frame.pixels = payload + kFramePixelOffset;
  frame.number = head.number;
  const std::string trouble = judge_header(frame.header, head.payload_bytes - kFramePixelOffset);
  frame.pixel_bytes = static_cast<std::uint64_t>(frame.header.stride_bytes) * frame.header.height_px;
  return trouble;
}

std::string read_raw_frame(const void* chunk, std::uint64_t bytes, const FrameHeader& expected, TimeNs at_ns,
                           FrameView& frame) {
  frame.header = expected;
  frame.header.exposed_at_ns = at_ns;
  frame.pixels = static_cast<const std::byte*>(chunk);
  frame.pixel_bytes = static_cast<std::uint64_t>(expected.stride_bytes) * expected.height_px;
  frame.number = 0;
  if (bytes == frame.pixel_bytes) return {};
  return "wrong size: " + number(expected.width_px) + "x" + number(expected.height_px) + " " +
         format_name(expected.format) + " has " + number(frame.pixel_bytes) + " bytes, the message holds " +
         number(bytes);
}

}  // namespace wasp::iceoryx
