#include "faults/uart_line.h"

namespace wasp::faults {
namespace {

constexpr int kBitsPerByte = 10;  // start, 8 data from the lowest, stop

/// The level of the line `t` sender bits after the first start bit; idle (1) outside.
bool level(std::span<const std::uint8_t> bytes, double t) {
  if (t < 0) return true;
  const auto bit = static_cast<std::size_t>(t);
  const std::size_t byte = bit / kBitsPerByte, in_byte = bit % kBitsPerByte;
  if (byte >= bytes.size() || in_byte == kBitsPerByte - 1) return true;
  return in_byte != 0 && (bytes[byte] >> (in_byte - 1) & 1) != 0;
}

}  // namespace

std::vector<std::uint8_t> heard_at(std::span<const std::uint8_t> bytes, double sender_baud, double receiver_baud) {
  const double bit = sender_baud / receiver_baud;  // of the receiver, in sender bits
  const double end = static_cast<double>(bytes.size() * kBitsPerByte);
  constexpr double kLook = 1.0 / 16;  // receivers sample sixteen times a bit
  std::vector<std::uint8_t> heard;
  for (double t = 0; t < end; t += kLook * bit) {
    if (level(bytes, t)) continue;
    if (level(bytes, t + 0.5 * bit)) continue;  // a glitch, no start bit
    std::uint8_t byte = 0;
    for (int i = 0; i < 8; ++i)
      if (level(bytes, t + (1.5 + i) * bit)) byte = static_cast<std::uint8_t>(byte | 1u << i);
    if (level(bytes, t + 9.5 * bit)) heard.push_back(byte);
    t += 9.5 * bit;
  }
  return heard;
}

}  // namespace wasp::faults
