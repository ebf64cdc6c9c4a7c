// A thread that keeps its core busy, as a fault.
#pragma once

#include "rt/clock.h"
#include "scheduling/realtime_loop.h"

namespace wasp::scheduling {

/// Busy for `duration_ns`, or until the flight ends. Realtime-safe: yes (bounded by both).
inline void be_busy_for(DurationNs duration_ns, const LoopControl& control) WASP_REALTIME {
  const TimeNs until_ns = rt::now() + duration_ns;
  while (rt::now() < until_ns && !control.stop.load(std::memory_order_relaxed)) {
  }
}

}  // namespace wasp::scheduling
