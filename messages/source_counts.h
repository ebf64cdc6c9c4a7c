// What a receiver counts: over the whole link and per sender, with losses read from gaps in the senders' sequences.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "rt/contract.h"

namespace wasp::mavlink {

/// Counts of a link since start. `bad_crc`, `bad_header` and the rest exclude what was found by rescanning inside a
/// frame already counted.
struct Counts {
  std::uint64_t bytes = 0;
  std::uint64_t good = 0;               ///< frames handed out
  std::uint64_t bad_crc = 0;            ///< known id, wrong checksum
  std::uint64_t bad_header = 0;         ///< where a frame was due: source 0, or a version 1 length that cannot be
  std::uint64_t unknown_id = 0;         ///< where a frame was due: an id this message set lacks, so not verifiable
  std::uint64_t unsupported_flags = 0;  ///< where a frame was due: incompatibility bits other than "signed"
  std::uint64_t sequence_lost = 0;      ///< frames missing by sequence number
  std::uint64_t signed_frames = 0;      ///< good frames that carry a signature (not verified)
  std::uint64_t skipped_bytes = 0;      ///< bytes in no frame, good or passed over whole
  std::uint64_t untracked_sources = 0;  ///< good frames of senders the table below has no room for
};

/// Counts of one sender.
struct SourceCounts {
  std::uint8_t system_id = 0, component_id = 0;  ///< 0: row not in use
  std::uint8_t last_sequence = 0;
  std::uint64_t good = 0;
  std::uint64_t bad_crc = 0, unknown_id = 0, unsupported_flags = 0;  ///< as claimed by headers nobody could verify
  std::uint64_t sequence_lost = 0;
  std::uint64_t repeated = 0;               ///< good frames with the number of the one before: sent twice, or echoed
  std::uint32_t unverified_since_good = 0;  ///< frames passed over since the last good one: not lost
};

/// Rows for the first 16 senders of good frames. Realtime-safe: yes.
class SourceTable {
 public:
  /// Row of a sender, nullptr if it never sent a good frame.
  SourceCounts* find(std::uint8_t system_id, std::uint8_t component_id) WASP_REALTIME {
    for (std::size_t i = 0; i < used_; ++i)
      if (rows_[i].system_id == system_id && rows_[i].component_id == component_id) return &rows_[i];
    return nullptr;
  }
  /// Books a good frame; returns how many frames went missing before it.
  std::uint64_t add_good(std::uint8_t system_id, std::uint8_t component_id, std::uint8_t sequence,
                         std::uint64_t& untracked) WASP_REALTIME;
  [[nodiscard]] std::span<const SourceCounts> rows() const noexcept { return {rows_.data(), used_}; }

 private:
  std::array<SourceCounts, 16> rows_{};
  std::size_t used_ = 0;
};

}  // namespace wasp::mavlink
