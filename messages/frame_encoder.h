// Writes version 2 frames: pack, cut trailing zeros (never below one byte), checksum, signature where asked for.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "messages/frame_layout.h"
#include "messages/frame_signature.h"

namespace wasp::mavlink {

/// One sender on one link: owns the sequence counter, which threads may share. Realtime-safe: yes, all of it.
class Encoder {
 public:
  Encoder(std::uint8_t system_id, std::uint8_t component_id) noexcept
      : system_id_(system_id), component_id_(component_id) {}

  /// Bytes written to `out` (12 ... 280); 0 if `out` is too small, and then the sequence does not move.
  template <class M>
  std::size_t encode(const M& message, std::span<std::uint8_t> out) WASP_REALTIME {
    std::array<std::uint8_t, M::kMaxLength> payload;
    message.pack(payload.data());
    return write(M::kId, M::kCrcExtra, payload, out);
  }
  /// From now on every frame is signed, by somebody who outlives this encoder. Before the first frame only.
  void sign_with(FrameSigner& signer) noexcept { signer_ = &signer; }

  [[nodiscard]] std::uint8_t system_id() const noexcept { return system_id_; }
  [[nodiscard]] std::uint8_t component_id() const noexcept { return component_id_; }
  /// Sets the sequence number of the next frame.
  void set_sequence(std::uint8_t next) noexcept { sequence_ = next; }

 private:
  std::size_t write(std::uint32_t id, std::uint8_t crc_extra, std::span<const std::uint8_t> payload,
                    std::span<std::uint8_t> out) WASP_REALTIME;

  std::uint8_t system_id_, component_id_;
  std::uint8_t sequence_ = 0;  ///< counted up through atomic_ref
  FrameSigner* signer_ = nullptr;
};

}  // namespace wasp::mavlink
