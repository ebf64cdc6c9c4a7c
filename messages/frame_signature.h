// Signatures of version 2 frames (MAVLink guide, "Message Signing"): a link id, 6 bytes of time, and the first 48 bits of
// SHA-256 over key, frame, link id and time. The hash is nettle's, which allocates nothing.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>

#include "messages/signing_clock.h"
#include "messages/signing_key.h"
#include "types/realtime.h"

namespace wasp::mavlink {

/// The six bytes for `covered`: the frame from its start byte to its checksum, link id, time. Realtime-safe: yes.
std::array<std::uint8_t, 6> signature_of(const SigningKey& key, std::span<const std::uint8_t> covered) WASP_REALTIME;

/// Signs what this process sends. Each thread is a stream of its own (link ids `first_link` and up), since a receiver
/// refuses times that arrive out of order and two threads may write in another order than they signed.
class FrameSigner {
 public:
  FrameSigner(const SigningKey& key, SigningClock& clock, std::uint8_t first_link) noexcept
      : key_(key), clock_(clock), first_link_(first_link) {}

  /// Writes 13 bytes behind the `n` bytes of a frame whose signed bit is set. Realtime-safe: yes.
  void append(std::span<std::uint8_t> out, std::size_t n) WASP_REALTIME;

 private:
  static constexpr std::size_t kThreads = 8;  ///< the last link id is shared by all beyond

  std::uint8_t link_of_this_thread() WASP_REALTIME;

  SigningKey key_;
  SigningClock& clock_;
  std::uint8_t first_link_;
  std::array<std::atomic<const int*>, kThreads> threads_{};  ///< by the address of their errno
};

}  // namespace wasp::mavlink
