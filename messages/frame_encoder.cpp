#include "messages/frame_encoder.h"

#include <atomic>

#include "messages/checksum.h"

namespace wasp::mavlink {
namespace {

/// Length without trailing zeros, at least 1.
std::size_t trimmed_length(std::span<const std::uint8_t> payload) noexcept {
  std::size_t n = payload.size();
  while (n > 1 && payload[n - 1] == 0) --n;
  return n;
}

}  // namespace

std::size_t Encoder::write(std::uint32_t id, std::uint8_t crc_extra, std::span<const std::uint8_t> payload,
                           std::span<std::uint8_t> out) WASP_REALTIME {
  const std::size_t n = trimmed_length(payload);
  const std::size_t covered = kHeaderV2 + n + kChecksumBytes;
  const std::size_t total = covered + (signer_ != nullptr ? kSignatureBytes : 0);
  if (out.size() < total) return 0;
  const std::uint8_t sequence = std::atomic_ref(sequence_).fetch_add(1, std::memory_order_relaxed);
  const std::array<std::uint8_t, kHeaderV2> header{kStartV2,
                                                   static_cast<std::uint8_t>(n),
                                                   signer_ != nullptr ? kIncompatSigned : std::uint8_t{0},
                                                   0,
                                                   sequence,
                                                   system_id_,
                                                   component_id_,
                                                   static_cast<std::uint8_t>(id),
                                                   static_cast<std::uint8_t>(id >> 8),
                                                   static_cast<std::uint8_t>(id >> 16)};
  std::copy(header.begin(), header.end(), out.begin());
  std::copy(payload.begin(), payload.begin() + static_cast<std::ptrdiff_t>(n), out.begin() + kHeaderV2);
  const std::uint16_t crc = crc_add(crc_add(kCrcInitial, out.subspan(1, kHeaderV2 - 1 + n)), crc_extra);
  out[kHeaderV2 + n] = static_cast<std::uint8_t>(crc);
  out[kHeaderV2 + n + 1] = static_cast<std::uint8_t>(crc >> 8);
  if (signer_ != nullptr) signer_->append(out, covered);
  return total;
}

}  // namespace wasp::mavlink
