// Writes version 2 frames: pack, cut trailing zeros (never below one byte), checksum.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "messages/frame_layout.h"

namespace wasp::mavlink {

/// One sender on one link: owns the sequence counter, which threads may share. Realtime-safe: yes, all of it.
class Encoder {
 public:
  Encoder(std::uint8_t system_id, std::uint8_t component_id) noexcept
      : system_id_(system_id), component_id_(component_id) {}

  /// Bytes written to `out` (12 ... 267); 0 if `out` is too small, and then the sequence does not move.
  template <class M>
  std::size_t encode(const M& message, std::span<std::uint8_t> out) WASP_REALTIME {
    std::array<std::uint8_t, M::kMaxLength> payload;
    message.pack(payload.data());
    return write(M::kId, M::kCrcExtra, payload, 0, out);
  }

  /// As encode, with the signed bit set and 13 bytes more: `link`, the low 48 bits of `timestamp` (10 us units since
  /// 2015-01-01), and the six bytes that `sign(span over frame, link and timestamp, six bytes out)` writes.
  template <class M, class Sign>
  std::size_t encode_signed(const M& message, std::uint8_t link, std::uint64_t timestamp, Sign&& sign,
                            std::span<std::uint8_t> out) WASP_REALTIME {
    if (out.size() < kSignatureBytes) return 0;
    std::array<std::uint8_t, M::kMaxLength> payload;
    message.pack(payload.data());
    const std::size_t n =
        write(M::kId, M::kCrcExtra, payload, kIncompatSigned, out.first(out.size() - kSignatureBytes));
    if (n == 0) return 0;
    out[n] = link;
    for (std::size_t i = 0; i < 6; ++i) out[n + 1 + i] = static_cast<std::uint8_t>(timestamp >> (8 * i));
    sign(std::span<const std::uint8_t>(out.first(n + 7)), out.data() + n + 7);
    return n + kSignatureBytes;
  }

  [[nodiscard]] std::uint8_t system_id() const noexcept { return system_id_; }
  [[nodiscard]] std::uint8_t component_id() const noexcept { return component_id_; }
  /// Sets the sequence number of the next frame.
  void set_sequence(std::uint8_t next) noexcept { sequence_ = next; }

 private:
  std::size_t write(std::uint32_t id, std::uint8_t crc_extra, std::span<const std::uint8_t> payload,
                    std::uint8_t incompat_flags, std::span<std::uint8_t> out) WASP_REALTIME;

  std::uint8_t system_id_, component_id_;
  std::uint8_t sequence_ = 0;  ///< counted up through atomic_ref
};

}  // namespace wasp::mavlink
