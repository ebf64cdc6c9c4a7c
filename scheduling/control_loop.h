// The control thread: every period on the grid it gathers cues, attitude and acceleration, runs control_step, and hands
// the command to the serial line in one write. It waits for nobody; what is not there is absent. The
// heartbeat and arming go out from here too: what keeps the autopilot following comes from one thread.
#pragma once

#include <array>
#include <vector>

#include "control/control_step.h"
#include "drivers/autopilot_link.h"
#include "drivers/autopilot_setup.h"
#include "drivers/line_port.h"
#include "rt/periodic.h"
#include "rt/seqlock.h"
#include "scheduling/config.h"
#include "scheduling/events.h"
#include "scheduling/guard_block.h"
#include "scheduling/realtime_loop.h"
#include "scheduling/setpoint_line.h"
#include "shm/broadcast_ring.h"

namespace wasp::scheduling {

/// What the link thread tells the control thread of the autopilot.
struct LinkReport {
  TimeNs heard_at_ns = kNever;
  std::uint32_t armed = 0;
  std::uint32_t custom_mode = 0;
  drivers::SetupBar setup_bar = drivers::SetupBar::kNone;  ///< why it must not be armed
  AutopilotSemantics semantics;
};

/// A stall in the middle of a tick, between what the arbiter said and the write: for tests and for fault points. Null
/// in a flight without faults.
struct ControlHook {
  void (*before_write)(void* context, std::uint64_t tick) WASP_REALTIME = nullptr;
  void* context = nullptr;
};

struct ControlWiring {
  const shm::Region* flight = nullptr;
  StageTable* stages = nullptr;
  const rt::Seqlock<LinkReport>* link = nullptr;
  drivers::LinePort* port = nullptr;
  drivers::AutopilotLink* autopilot = nullptr;
  EventQueue* events = nullptr;
  ThreadWatch* watch = nullptr;                            ///< required
  std::vector<const ThreadWatch*> behaviour_watches = {};  ///< by Cue::behaviour, nullptr: not enabled; may be empty
  GuardBlock* guard = nullptr;                             ///< null without a guardian
  ControlHook hook = {};
};

class ControlLoop {
 public:
  ControlLoop(const Config& config, const ControlWiring& wiring);
  /// Runs until the mission is over or the stop flag. Real-time loop.
  void run(LoopControl& control);
  [[nodiscard]] bool mission_over() const noexcept { return mission_over_.load(); }

 private:
  /// An enabled behaviour.
  struct CueSource {
    std::size_t behaviour;  ///< Cue::behaviour
    shm::RingReader ring;
    const ThreadWatch* watch;  ///< may be nullptr
    Stage* age;
    Stage* end_to_end;
  };
  void tick(const rt::Release& release, LoopControl& control) WASP_REALTIME;
  void gather(control::ControlInput& input) WASP_REALTIME;
  void mean_inertial(control::ControlInput& input) WASP_REALTIME;
  void release(const rt::Release& release, LoopControl& control) WASP_REALTIME;
  std::size_t encode(const Command& command, TimeNs now_ns) WASP_REALTIME;
  std::size_t refuse_if_too_old(const control::ControlInput& input, control::ControlOutput& output, std::size_t used,
                                LoopControl& control) WASP_REALTIME;
  void send(const control::ControlInput& input, control::ControlOutput& output, LoopControl& control) WASP_REALTIME;
  std::size_t append_heartbeat(const Command& command, std::uint32_t incarnation, std::size_t used) WASP_REALTIME;
  std::size_t append_requests(const control::ControlInput& input, const control::ControlOutput& output,
                              std::size_t used, TimeNs now_ns) WASP_REALTIME;
  [[nodiscard]] bool may_enter_mode(TimeNs now_ns) const WASP_REALTIME;
  void account(const control::ControlInput& input, const Command& command, std::uint64_t skipped,
               LoopControl& control) WASP_REALTIME;
  void account_cues(const control::ControlInput& input, const Command& command, RunStatus& status) WASP_REALTIME;
  void report_miss(const Command& command, std::uint64_t skipped, bool missed) WASP_REALTIME;
  void end_of_tick(const control::ControlInput& input, LoopControl& control) WASP_REALTIME;
  [[nodiscard]] bool line_is_ours() const WASP_REALTIME;
  void beat(const control::ControlInput& input, const control::ControlOutput& output) WASP_REALTIME;
  void last_beat() noexcept;
  void mark(const control::ControlInput& input, const Command& command, LoopControl& control) WASP_REALTIME;
  /// Why the vehicle must not be armed now; null: it may.
  [[nodiscard]] const char* bar_to_arming(TimeNs now_ns) WASP_REALTIME;
  void announce(const Command& command, const char* bar) WASP_REALTIME;

  Config config_;
  ControlWiring wiring_;
  control::ControlState state_;
  std::vector<CueSource> cues_;
  shm::RingReader attitude_, imu_;
  shm::RingWriter commands_;
  Stage *wake_, *compute_, *write_, *tick_to_byte_;
  SetpointLine line_;
  std::array<std::uint8_t, 1024> out_{};
  std::array<TimeNs, control::kMaxBehaviours> last_exposed_{};
  TimeNs heartbeat_due_ns_ = 0, request_due_ns_ = 0;
  TimeNs streaming_since_ns_ = kNever;  ///< setpoints have gone out at every tick
  drivers::CompanionState told_;        ///< in the last heartbeat
  int consecutive_misses_ = 0;
  TimeNs punctual_from_ns_ = 0;  ///< two misses in a row bar arming until then
  FlightMode announced_mode_ = FlightMode::kDisarmed;
  ModeReason announced_reason_ = ModeReason::kNone;
  drivers::SetupBar setup_bar_ = drivers::SetupBar::kNone;
  const char* announced_bar_ = nullptr;
  std::uint8_t announced_phase_ = 255;
  control::EarlyEnd announced_end_ = control::EarlyEnd::kNone;
  std::atomic<bool> mission_over_{false};
};

}  // namespace wasp::scheduling
