// Who may speak on a signed link: the receiver's rules (MAVLink guide, "Message Signing") as a policy that the parser
// asks of each frame whose checksum holds. A stream is a sender and its link id; its times must rise, and the first may
// not lie more than a minute behind ours. Unsigned frames pass where signing is not required, or by name: RADIO_STATUS,
// which radios put into the stream by themselves.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "messages/frame_layout.h"
#include "messages/frame_signature.h"

namespace wasp::mavlink {

enum class SignatureVerdict : std::uint8_t {
  kVerified,
  kUnsignedAllowed,
  kUnsignedRefused,
  kWrong,    ///< signed with another key, or damaged
  kOld,      ///< time not after the last of its stream: a replay, or out of order
  kTooLate,  ///< first of its stream, and more than a minute behind our time
  kNoRoom,   ///< more streams than the table holds
};

/// Frames by verdict.
struct SignatureCounts {
  std::uint64_t verified = 0, unsigned_allowed = 0, unsigned_refused = 0, wrong = 0, old = 0, too_late = 0, no_room = 0;

  [[nodiscard]] std::uint64_t refused() const noexcept { return unsigned_refused + wrong + old + too_late + no_room; }
};

/// Receiving thread only. Realtime-safe: yes, all of it.
class SignatureCheck {
 public:
  /// `clock` goes on with the times of verified frames, and with nothing else from the wire.
  SignatureCheck(const SigningKey& key, SigningClock& clock, bool required) noexcept
      : key_(key), clock_(clock), required_(required) {}

  SignatureVerdict judge(const Frame& frame) WASP_REALTIME;
  [[nodiscard]] const SignatureCounts& counts() const noexcept { return counts_; }

 private:
  struct Stream {
    std::uint8_t system_id = 0, component_id = 0, link = 0;
    std::uint64_t last = 0;
  };
  SignatureVerdict judge_unsigned(const Frame& frame) const WASP_REALTIME;
  SignatureVerdict judge_signed(const Frame& frame) WASP_REALTIME;
  SignatureVerdict judge_time(const Frame& frame) WASP_REALTIME;
  Stream* find(const Frame& frame) WASP_REALTIME;

  SigningKey key_;
  SigningClock& clock_;
  bool required_;
  std::array<Stream, 16> streams_{};
  std::size_t used_ = 0;
  SignatureCounts counts_;
};

/// Whether a frame with this verdict goes on to whoever listens.
constexpr bool passes(SignatureVerdict verdict) WASP_REALTIME {
  return verdict == SignatureVerdict::kVerified || verdict == SignatureVerdict::kUnsignedAllowed;
}

}  // namespace wasp::mavlink
