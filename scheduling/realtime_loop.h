// What every real-time loop shares: the arming mark, the fault count, the optional system-call filter, the stop flag.
#pragma once

#include <atomic>

#include "rt/contract.h"
#include "rt/syscall_filter.h"
#include "scheduling/fault_points.h"
#include "scheduling/mission_marks.h"
#include "scheduling/stage_table.h"
#include "scheduling/thread_watch.h"

namespace wasp::scheduling {

/// State shared by all loops of one flight process.
struct LoopControl {
  std::atomic<bool> stop{false};              ///< end all loops
  std::atomic<bool> stop_requested{false};    ///< land in order, then end
  std::atomic<bool> overrun_stop{false};      ///< ... because a thread with the policy "stop" overran
  std::atomic<bool> realtime_started{false};  ///< set once every thread stands: faults count from here
  std::atomic<bool> flying{false};            ///< set once the mission has left the ground: a replay starts then
  MissionMarks marks;                         ///< what the mission has reached, and when
  bool strict_syscalls = false;
  const FaultBoard* faults = nullptr;  ///< null unless the flight was started with faults
  RunStatus* status = nullptr;
};

/// Lives for the duration of a loop on its own thread. Counts page faults from the first `tick()` after the start of
/// real time, adds them to the run status at the end.
class RealtimeLoop {
 public:
  RealtimeLoop(LoopControl& control, ThreadWatch& watch) : control_(control) {
    watch.attach();
    if (control.strict_syscalls) rt::restrict_thread_syscalls();
  }
  ~RealtimeLoop() { add_faults(); }
  RealtimeLoop(const RealtimeLoop&) = delete;
  RealtimeLoop& operator=(const RealtimeLoop&) = delete;

  /// Once a cycle; false when the loop must end. Realtime-safe: yes.
  bool tick() WASP_REALTIME {
    if (!marked_ && control_.realtime_started.load(std::memory_order_relaxed)) {
      marked_ = true;
      at_start_ = rt::thread_usage();
    }
    return !control_.stop.load(std::memory_order_relaxed);
  }

 private:
  void add_faults() noexcept {
    if (!marked_ || control_.status == nullptr) return;
    const rt::ThreadUsage since = rt::thread_usage() - at_start_;
    control_.status->minor_faults.fetch_add(static_cast<std::uint64_t>(since.minor_faults));
    control_.status->major_faults.fetch_add(static_cast<std::uint64_t>(since.major_faults));
  }
  LoopControl& control_;
  rt::ThreadUsage at_start_;
  bool marked_ = false;
  rt::RealtimeSection section_;
};

}  // namespace wasp::scheduling
