// What the generated message structs rest on: the row of the message table, and copies between fields and payload.
// Payloads are little-endian without padding (MAVLink guide, "Packet Serialization"), so on a little-endian machine a
// field or a whole array is one memcpy.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace wasp::mavlink {

static_assert(std::endian::native == std::endian::little, "payload fields are copied without byte swaps");

inline constexpr std::size_t kMaxPayload = 255;

/// One message type as the codec needs it.
struct MessageInfo {
  std::uint32_t id = 0;
  const char* name = "";
  std::uint8_t crc_extra = 0;
  std::size_t min_length = 0;  ///< base fields only: the length of a version 1 payload
  std::size_t max_length = 0;  ///< with extensions
};

namespace wire {

template <class T>
void put(std::uint8_t* at, const T& field) noexcept {
  static_assert(std::is_trivially_copyable_v<T>);
  std::memcpy(at, &field, sizeof(T));
}

template <class T>
void get(const std::uint8_t* at, T& field) noexcept {
  static_assert(std::is_trivially_copyable_v<T>);
  std::memcpy(&field, at, sizeof(T));
}

/// A payload brought to its full length: what was cut off reads as zero, surplus is dropped.
template <std::size_t N>
std::array<std::uint8_t, N> full_length(const std::uint8_t* payload, std::size_t length) noexcept {
  std::array<std::uint8_t, N> full{};
  if (const std::size_t kept = length < N ? length : N; kept > 0) std::memcpy(full.data(), payload, kept);
  return full;
}

}  // namespace wire
}  // namespace wasp::mavlink
