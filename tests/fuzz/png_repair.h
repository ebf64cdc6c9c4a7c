// Makes the chunk checksums of a PNG right, which a fuzzer never hits: only so do its changes get past the first chunk.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <vector>

namespace wasp::fuzz {

inline void repair_png(std::vector<std::uint8_t>& png) {
  const auto word = [&png](std::size_t at) {
    return std::uint32_t{png[at]} << 24 | std::uint32_t{png[at + 1]} << 16 | std::uint32_t{png[at + 2]} << 8 |
           png[at + 3];
  };
  for (std::size_t at = 8; at + 12 <= png.size();) {
    const std::size_t length = word(at);
    if (length > png.size() - at - 12) return;
    const auto crc = crc32(crc32(0, nullptr, 0), png.data() + at + 4, static_cast<uInt>(length + 4));
    for (std::size_t i = 0; i < 4; ++i) png[at + 8 + length + i] = static_cast<std::uint8_t>(crc >> (24 - 8 * i));
    at += length + 12;
  }
}

}  // namespace wasp::fuzz
