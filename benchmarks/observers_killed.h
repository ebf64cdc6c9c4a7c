// Observers of a live flight and camera region, killed and frozen at any instant: what they accepted, what they left
// behind, and what the writer noticed. Each message is a pattern of its ring and number, so that a torn one is seen.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "types/time.h"

namespace wasp::bench {

struct KillOptions {
  std::uint64_t kills = 300;              ///< of observers; as many bystanders die in the blocks without
  std::uint64_t kills_a_block = 250;      ///< blocks with and without take turns
  DurationNs tick_ns = kMillisecond / 4;  ///< of the writer: an IMU sample each, everything else at a fraction of it
  bool careful = true;                    ///< false: observers do not look again after use (negative control)
};

/// The writer's own times in blocks of one kind [ns].
struct WriterTimes {
  std::vector<std::int64_t> message_ns;  ///< loan, 64 bytes or a few more, publish
  std::vector<std::int64_t> frame_ns;    ///< loan, 307,200 bytes, publish
  std::vector<std::int64_t> late_ns;     ///< wake-up after the tick was due
};

struct KillResult {
  std::string trouble;  ///< empty: all blocks ran
  std::uint64_t deaths = 0, freezes = 0;
  std::uint64_t accepted = 0, dropped = 0;  ///< messages observers believed, and those they found overwritten after use
  std::uint64_t torn = 0, backwards = 0;    ///< of the accepted: must be 0
  std::uint64_t published = 0;
  std::uint64_t slots = 0,
                slots_leaked = 0;  ///< of all rings; leaked: not holding one of the newest messages at the end
  WriterTimes spared, tormented;
};

/// Takes some 10 ms a kill, twice (with and without).
KillResult torment_observers(const KillOptions& options);

}  // namespace wasp::bench
