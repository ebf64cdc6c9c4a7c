// A wrong baud rate: bytes sent at one rate, 8 data bits, no parity, 1 stop bit, and heard by a receiver at another,
// which looks for a falling edge and samples the middle of what it takes for bits.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace wasp::faults {

/// What a receiver at `receiver_baud` makes of back-to-back `bytes` sent at `sender_baud`; bytes whose stop bit reads 0
/// (framing errors) are dropped. Both rates > 0.
std::vector<std::uint8_t> heard_at(std::span<const std::uint8_t> bytes, double sender_baud, double receiver_baud);

}  // namespace wasp::faults
