// One page between the flying process and its guardian: a sealed memfd that neither can shrink. The flying process says
// that its control thread lives and what would be neutral now; the guardian says who has the line. Single words, never
// a mutex: whatever instruction one side dies at, the other goes on.
#pragma once

#include <atomic>
#include <cstdint>

#include "types/time.h"

namespace wasp::scheduling {

/// Whose setpoints go out.
enum class LineOwner : std::uint32_t { kFlight = 0, kGuardian = 1 };

struct GuardBlock {
  static constexpr std::uint64_t kMagic = 0x31'64'72'61'75'67ull;  // "guard1"
  std::uint64_t magic = kMagic;

  // Written by the control thread of the flying process, at the end of every tick, `beat_at_ns` last.
  alignas(64) std::atomic<std::uint64_t> tick{0};
  std::atomic<TimeNs> next_due_ns{0};         ///< when the next release falls due; 0: control does not run (yet)
  std::atomic<std::uint32_t> commanding{0};   ///< 1: setpoints go out to an armed vehicle
  std::atomic<float> yaw_rad{0};              ///< of the last attitude
  std::atomic<float> neutral_thrust{0};       ///< level, a gentle descent: 0 ... 1; 0 on the ground
  std::atomic<std::uint32_t> custom_mode{0};  ///< of the last heartbeat (drivers/companion_state.h)
  std::atomic<TimeNs> beat_at_ns{0};
  std::atomic<std::uint64_t> signing_time{0};  ///< reached on a signed line: whoever speaks next goes on from there

  // Written by the guardian.
  alignas(64) std::atomic<std::uint32_t> owner{0};  ///< LineOwner; the control thread writes nothing while it is 1
  std::atomic<std::uint32_t> incarnation{0};        ///< 0: the first flying process, 1: started again once, ...
  std::atomic<std::uint64_t> takeovers{0};          ///< times the guardian had to speak
  std::atomic<std::uint64_t> setpoints{0};          ///< that it sent
};
static_assert(sizeof(GuardBlock) <= 4096);
static_assert(std::atomic<TimeNs>::is_always_lock_free && std::atomic<float>::is_always_lock_free);

}  // namespace wasp::scheduling
