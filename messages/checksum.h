// CRC-16/MCRF4XX: polynomial 0x1021 reflected (0x8408), initial value 0xFFFF, no final XOR; "123456789" gives 0x6F91.
// MAVLink runs it from the length byte to the last payload byte as sent, then over the message's CRC_EXTRA.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt/contract.h"

namespace wasp::mavlink {

inline constexpr std::uint16_t kCrcInitial = 0xFFFF;

namespace detail {
constexpr std::array<std::uint16_t, 256> crc_table() noexcept {
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) != 0 ? (crc >> 1) ^ 0x8408u : crc >> 1;
    table[byte] = static_cast<std::uint16_t>(crc);
  }
  return table;
}
inline constexpr auto kCrcTable = crc_table();
}  // namespace detail

/// `crc` continued over one byte. Realtime-safe: yes.
constexpr std::uint16_t crc_add(std::uint16_t crc, std::uint8_t byte) WASP_REALTIME {
  return static_cast<std::uint16_t>((crc >> 8) ^ detail::kCrcTable[(crc ^ byte) & 0xFFu]);
}

/// `crc` continued over `bytes`. Realtime-safe: yes, linear in the length.
constexpr std::uint16_t crc_add(std::uint16_t crc, std::span<const std::uint8_t> bytes) WASP_REALTIME {
  for (const std::uint8_t byte : bytes) crc = crc_add(crc, byte);
  return crc;
}

}  // namespace wasp::mavlink
