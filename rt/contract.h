// Real-time sections: where a thread is bound by the contract that WASP_REALTIME (types/realtime.h) states. The malloc
// guard of the tests reads the depth.
#pragma once

#include <atomic>

#include "types/realtime.h"

namespace wasp::rt {

/// Depth of real-time sections on this thread; allocator guards in tests read it.
inline thread_local int realtime_depth = 0;

/// The fences keep each change of depth in its place: the compiler knows that malloc reads no variable of ours, and
/// would otherwise move or drop the stores around it. Realtime-safe: yes (no instruction).
inline void set_realtime_depth(int depth) noexcept {
  std::atomic_signal_fence(std::memory_order_seq_cst);
  realtime_depth = depth;
  std::atomic_signal_fence(std::memory_order_seq_cst);
}

/// While alive, this thread is inside its real-time loop. Realtime-safe: yes.
class RealtimeSection {
 public:
  RealtimeSection() noexcept { set_realtime_depth(realtime_depth + 1); }
  ~RealtimeSection() { set_realtime_depth(realtime_depth - 1); }
  RealtimeSection(const RealtimeSection&) = delete;
  RealtimeSection& operator=(const RealtimeSection&) = delete;
};

/// Leaves the section for a moment the contract does not cover (start-up, an orderly stop). Realtime-safe: yes.
class NonRealtimeSection {
 public:
  NonRealtimeSection() noexcept : saved_(realtime_depth) { set_realtime_depth(0); }
  ~NonRealtimeSection() { set_realtime_depth(saved_); }
  NonRealtimeSection(const NonRealtimeSection&) = delete;
  NonRealtimeSection& operator=(const NonRealtimeSection&) = delete;

 private:
  int saved_;
};

}  // namespace wasp::rt
