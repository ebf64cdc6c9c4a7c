// The frame around a payload, versions 1 and 2 (MAVLink guide, "Packet Serialization"), and a view of one that passed
// its checksum.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "messages/mavlink_messages.h"
#include "rt/contract.h"

namespace wasp::mavlink {

inline constexpr std::uint8_t kStartV1 = 0xFE, kStartV2 = 0xFD;
inline constexpr std::size_t kHeaderV1 = 6, kHeaderV2 = 10, kChecksumBytes = 2, kSignatureBytes = 13;
inline constexpr std::uint8_t kIncompatSigned = 0x01;
inline constexpr std::size_t kMaxFrame = kHeaderV2 + kMaxPayload + kChecksumBytes + kSignatureBytes;
static_assert(kMaxFrame == 280);

/// Row of a message id, nullptr if `messages`, which rise in id, lack it. Realtime-safe: yes (binary search).
inline const MessageInfo* find_message(std::uint32_t id,
                                       std::span<const MessageInfo> messages = kMessages) WASP_REALTIME {
  const auto row = std::lower_bound(messages.begin(), messages.end(), id,
                                    [](const MessageInfo& info, std::uint32_t wanted) { return info.id < wanted; });
  return row != messages.end() && row->id == id ? &*row : nullptr;
}

/// One frame with a good checksum. Pointers are valid for the duration of the callback that hands it out.
struct Frame {
  std::uint8_t version = 2;  ///< 1 or 2
  std::uint8_t sequence = 0;
  std::uint8_t system_id = 0, component_id = 0;  ///< of the sender, 1 ... 255
  std::uint32_t message_id = 0;
  const std::uint8_t* payload = nullptr;
  std::size_t length = 0;                   ///< bytes sent: 0 ... 255, may be below or above the message's own length
  bool is_signed = false;                   ///< carries a signature
  bool is_verified = false;                 ///< and it was found right (signature_check.h)
  std::span<const std::uint8_t> signature;  ///< link id, 6 bytes of time, 6 bytes of hash; empty when unsigned
  std::span<const std::uint8_t> wire;       ///< the whole frame as received

  template <class M>
  [[nodiscard]] bool is() const noexcept {
    return message_id == M::kId;
  }
  /// The payload as M; the caller has asked `is<M>()`. Realtime-safe: yes.
  template <class M>
  [[nodiscard]] M as() const noexcept {
    return M::unpack(payload, length);
  }
};

}  // namespace wasp::mavlink
