// Faults of a behaviour, around its step: behaviour.*. Each adaptor has one; without a board nothing happens, at the
// cost of a branch a call.
#pragma once

#include "scheduling/realtime_loop.h"
#include "types/behaviour.h"

namespace wasp::scheduling {

class BehaviourFaults {
 public:
  /// Before the loop begins. `behaviour`: Cue::behaviour.
  void use(const LoopControl& control, std::uint32_t behaviour) noexcept {
    control_ = control.faults != nullptr ? &control : nullptr;
    target_ = static_cast<std::int32_t>(behaviour);
  }

  /// Right before the step. Realtime-safe: yes.
  void before(BehaviourInput& input) WASP_REALTIME {
    if (__builtin_expect(control_ != nullptr, 0)) corrupt(input);
  }
  /// Right after it, as a part of it: takes its time too. Realtime-safe: yes; while behaviour.endless is on, not before
  /// that is over or the flight ends.
  void after(CueBody& body) WASP_REALTIME {
    if (__builtin_expect(control_ != nullptr, 0)) corrupt(body);
  }
  /// The exposure a cue is said to rest on. Realtime-safe: yes.
  TimeNs exposure(TimeNs exposed_at_ns) WASP_REALTIME {
    return __builtin_expect(control_ != nullptr, 0) ? shifted(exposed_at_ns) : exposed_at_ns;
  }
  /// True if the cue is to be kept back. Realtime-safe: yes.
  [[nodiscard]] bool silent() const WASP_REALTIME {
    return __builtin_expect(control_ != nullptr, 0) && on(FaultPoint::kBehaviourSilent);
  }

 private:
  void corrupt(BehaviourInput& input) const WASP_REALTIME;
  void corrupt(CueBody& body) WASP_REALTIME;
  [[nodiscard]] TimeNs shifted(TimeNs exposed_at_ns) const WASP_REALTIME;
  [[nodiscard]] bool on(FaultPoint point) const WASP_REALTIME;
  void be_busy() const WASP_REALTIME;

  const LoopControl* control_ = nullptr;  ///< null: no fault points
  std::int32_t target_ = FaultBoard::kAnyTarget;
  CueBody stuck_;
  bool is_stuck_ = false;
};

}  // namespace wasp::scheduling
