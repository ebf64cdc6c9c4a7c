#include "sim/udp_line.h"

#include <algorithm>

namespace wasp::sim {
namespace {

constexpr std::size_t kMostDatagram = 1200;

/// Bytes of the MAVLink frame that begins here; everything left if none does.
std::size_t frame_length(std::span<const std::uint8_t> bytes) {
  constexpr std::uint8_t kV2 = 0xfd, kSigned = 1;
  if (bytes.size() < 3 || bytes[0] != kV2) return bytes.size();
  return std::min<std::size_t>(bytes.size(), 12u + bytes[1] + ((bytes[2] & kSigned) != 0 ? 13u : 0u));
}

}  // namespace

UdpLine::UdpLine(const std::string& there) : port_(drivers::Endpoint::parse("udpout://" + there)), input_(4096) {}

std::span<const std::uint8_t> UdpLine::read() {
  const drivers::IoResult got = port_.read(input_);
  return {input_.data(), got.bytes};
}

void UdpLine::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    std::size_t n = frame_length(bytes);
    while (n < bytes.size() && n + frame_length(bytes.subspan(n)) <= kMostDatagram) n += frame_length(bytes.subspan(n));
    port_.write(bytes.first(n));
    bytes = bytes.subspan(n);
  }
}

}  // namespace wasp::sim
