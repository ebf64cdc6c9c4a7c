// Campaigns on a recorded stream: the same frames however it is cut into pieces, and every undamaged frame found
// however the others are damaged.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "messages/message_info.h"
#include "tools/mavlink_scan.h"

namespace wasp::tools {

struct ChunkResult {
  std::uint64_t passes = 0;     ///< fixed pieces of 1 to 64 bytes, and random ones
  std::uint64_t different = 0;  ///< passes whose frames were not those of the whole stream
};

struct DamageResult {
  std::string name;
  std::uint64_t streams = 0, damaged_bytes = 0;
  std::uint64_t undamaged = 0;  ///< frames nobody touched
  std::uint64_t lost = 0;       ///< of them, not found: must be 0
  /// Of them, not found because a damaged frame before them passes its checksum (one in 65,536) and claims their bytes.
  std::uint64_t lost_to_collisions = 0;
  std::uint64_t accepted = 0;     ///< frames handed out
  std::uint64_t other_signature = 0;  ///< of them, frames damaged in their signature alone, which no checksum covers
  std::uint64_t collisions = 0;   ///< of them, frames that were not sent like that, but whose checksum holds
  std::uint64_t bad_checksum = 0; ///< of them, frames whose checksum does not hold by another implementation: must be 0
};

ChunkResult chunk_campaign(std::span<const std::uint8_t> stream, const std::vector<FoundFrame>& frames,
                           std::span<const mavlink::MessageInfo> messages);

/// Bit flips, dropped bytes, inserted bytes, and all of them: each at one damage in 20, 100 and 1000 bytes, `seeds` times.
std::vector<DamageResult> damage_campaigns(std::span<const std::uint8_t> stream, const std::vector<FoundFrame>& frames,
                                           std::span<const mavlink::MessageInfo> messages, unsigned seeds);

}  // namespace wasp::tools
