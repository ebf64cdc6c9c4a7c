// The checksum of a MAVLink frame a second time, bit by bit from its definition (CRC-16/MCRF4XX: reflected polynomial
// 0x8408, start 0xFFFF), and the frame's fields read by offsets from the guide: no line of messages/ is used, so that
// both would have to be wrong in the same way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace wasp::fuzz {

constexpr std::uint16_t bitwise_crc(std::uint16_t crc, std::uint8_t byte) {
  for (int bit = 0; bit < 8; ++bit) {
    const unsigned carry = (crc ^ (byte >> bit)) & 1u;
    crc = static_cast<std::uint16_t>(crc >> 1);
    if (carry != 0) crc ^= 0x8408u;
  }
  return crc;
}

/// True if the bytes are exactly one frame (version 1 or 2, signed or not) with the checksum that `crc_extra` gives.
constexpr bool is_whole_frame(std::span<const std::uint8_t> wire, std::uint8_t crc_extra) {
  if (wire.size() < 8 || (wire[0] != 0xFE && wire[0] != 0xFD)) return false;
  const bool v2 = wire[0] == 0xFD;
  const std::size_t header = v2 ? 10 : 6, signature = v2 && (wire[2] & 1u) != 0 ? 13 : 0;
  const std::size_t end = header + wire[1];
  if (wire.size() != end + 2 + signature) return false;
  std::uint16_t crc = 0xFFFF;
  for (std::size_t i = 1; i < end; ++i) crc = bitwise_crc(crc, wire[i]);
  crc = bitwise_crc(crc, crc_extra);
  return wire[end] == (crc & 0xFFu) && wire[end + 1] == crc >> 8;
}

}  // namespace wasp::fuzz
