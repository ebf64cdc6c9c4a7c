#include "scheduling/control_faults.h"

#include <algorithm>

#include "scheduling/busy_wait.h"

namespace wasp::scheduling {
namespace {

constexpr DurationNs kNap = 10 * kMillisecond;  // how soon a stalled tick sees the end of the flight

/// As long as the value says, the fault is on and the flight lasts.
void stall(const LoopControl& control) WASP_REALTIME {
  const FaultBoard& board = *control.faults;
  const TimeNs until_ns = rt::now() + milliseconds_of(board, FaultPoint::kControlStall);
  for (TimeNs now_ns = rt::now(); now_ns < until_ns && !control.stop.load(std::memory_order_relaxed);
       now_ns = rt::now())
    rt::sleep_until(std::min(until_ns, now_ns + kNap));
}

void hold_up(void* context, std::uint64_t) WASP_REALTIME {
  const auto& control = *static_cast<const LoopControl*>(context);
  const FaultBoard& board = *control.faults;
  if (board.on(FaultPoint::kControlStall, rt::now())) stall(control);
  if (board.on(FaultPoint::kControlSpin, rt::now()))
    be_busy_for(milliseconds_of(board, FaultPoint::kControlSpin), control);
}

}  // namespace

ControlHook control_fault_hook(LoopControl& control) { return {&hold_up, &control}; }

}  // namespace wasp::scheduling
