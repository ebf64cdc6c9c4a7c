// A message of an iceoryx service judged: is it a frame, and of what? Knows no iceoryx.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "tools/iceoryx_message.h"
#include "types/messages.h"

namespace wasp::iceoryx {

/// A frame in somebody else's memory: its header, and `pixel_bytes` at `pixels`.
struct FrameView {
  FrameHeader header;
  const std::byte* pixels = nullptr;
  std::uint64_t pixel_bytes = 0;
  std::uint64_t number = 0;  ///< the sender's own numbering, 0 if it has none
};

/// Judges `bytes` at `chunk` as MessageHead + FrameHeader + pixels. Empty if it is a frame, else why not.
std::string read_frame(const void* chunk, std::uint64_t bytes, FrameView& frame);

/// Judges bare pixels, rows packed, of exactly this size and format. The header is made up: exposed `at_ns`.
std::string read_raw_frame(const void* chunk, std::uint64_t bytes, const FrameHeader& expected, TimeNs at_ns,
                           FrameView& frame);

/// Bytes of one pixel; 0 for a format that is none.
constexpr std::uint32_t pixel_bytes(PixelFormat format) noexcept {
  return format == PixelFormat::kMono8 ? 1 : format == PixelFormat::kDepth16Mm ? 2 : 0;
}
constexpr const char* format_name(PixelFormat format) noexcept {
  return format == PixelFormat::kMono8 ? "mono8" : format == PixelFormat::kDepth16Mm ? "depth16" : "unknown";
}

}  // namespace wasp::iceoryx
