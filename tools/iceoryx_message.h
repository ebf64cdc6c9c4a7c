// What `wasp iceoryx` puts into a chunk and takes out of one: this head, then the bytes of the message as they lay in
// wasp's ring. Depends on nothing, so that another program may copy this one file. See docs/iceoryx.md.
#pragma once

#include <array>
#include <cstdint>

namespace wasp::iceoryx {

inline constexpr std::uint64_t kMessageMagic = 0x31'67'73'6d'77ull;  ///< "wmsg1"
inline constexpr std::uint32_t kMessageVersion = 1;

/// First 64 bytes of a chunk; the message follows. Little-endian, as the machine that shares the memory is.
struct MessageHead {
  std::uint64_t magic = kMessageMagic;
  std::uint32_t version = kMessageVersion;
  std::uint32_t payload_bytes = 0;   ///< of the message after this head
  std::uint64_t number = 0;          ///< of the message in its ring, from 1; a jump is a message the bridge lost
  std::int64_t published_at_ns = 0;  ///< CLOCK_MONOTONIC, when it entered wasp's ring
  std::array<char, 24> type{};       ///< as in wasp's directory: "Frame", "Imu", "Attitude", "Cue", "Command", "Truth"
  std::array<char, 8> reserved{};
};
static_assert(sizeof(MessageHead) == 64);

/// First part of every service name; the second is wasp's instance, the third its topic: wasp/demo/cue.ground_altitude.
inline constexpr const char* kService = "wasp";

}  // namespace wasp::iceoryx
