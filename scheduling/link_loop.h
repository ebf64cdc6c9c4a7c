// The link thread: bytes from the serial line become IMU and attitude samples in the rings, if they are plausible
// (drivers/sample_judge.h), and a report on the autopilot. It asks for the autopilot's time and answers when asked
// and lets telemetry speak, all of it only where the line has room before the next setpoint (line_gate.h), so that no
// setpoint is split or waits; reopens a lost line by itself, and says what is wrong with one on which nobody is
// understood.
#pragma once

#include "drivers/autopilot_link.h"
#include "drivers/autopilot_setup.h"
#include "drivers/line_port.h"
#include "drivers/sample_judge.h"
#include "rt/seqlock.h"
#include "scheduling/control_loop.h"
#include "scheduling/events.h"
#include "scheduling/line_gate.h"
#include "scheduling/realtime_loop.h"
#include "scheduling/sample_faults.h"
#include "scheduling/telemetry.h"
#include "shm/broadcast_ring.h"

namespace wasp::scheduling {

/// What the link thread does besides.
struct LinkServices {
  Telemetry* telemetry = nullptr;  ///< nullptr: nothing is told, and nobody is answered
  LineGateParams gate = {};
  DurationNs control_period_ns = 50 * kMillisecond;
  DurationNs position_period_ns = 0;  ///< of LOCAL_POSITION_NED, asked for; 0: not asked for, taken when it comes
};

class LinkLoop {
 public:
  LinkLoop(const shm::Region& flight, drivers::LinePort& port, drivers::AutopilotLink& autopilot, StageTable& stages,
           rt::Seqlock<LinkReport>& report, EventQueue& events, ThreadWatch& watch, const drivers::SetupWish& wish = {},
           const LinkServices& services = {});
  /// Runs until the stop flag. Real-time loop.
  void run(LoopControl& control);

  // What AutopilotLink::receive calls.
  void on_imu(const ImuSample& sample) WASP_REALTIME;
  void on_attitude(const AttitudeSample& sample) WASP_REALTIME;
  void on_heartbeat(const drivers::AutopilotStatus& status) WASP_REALTIME;
  void on_ack(std::uint16_t command, std::uint8_t result) WASP_REALTIME;
  void on_statustext(std::uint8_t severity, std::string_view text) WASP_REALTIME;
  void on_frame(const mavlink::Frame& frame) WASP_REALTIME;
  void reply(std::span<const std::uint8_t> bytes) WASP_REALTIME;

 private:
  void serve(LoopControl& control) WASP_REALTIME;
  void take(LoopControl& control) WASP_REALTIME;
  void ask_for_time(TimeNs now_ns) WASP_REALTIME;
  void reopen(LoopControl& control);
  /// What was last said of a stream, and until when it is not said again.
  struct Told {
    drivers::SampleFault fault = drivers::SampleFault::kNone;
    TimeNs until_ns = 0;
  };
  bool usable(drivers::SampleFault fault, std::string_view head, Told& told) WASP_REALTIME;
  void tell(drivers::SampleFault fault, std::string_view head, Told& told) WASP_REALTIME;
  void watch_the_other_side(RunStatus& status) WASP_REALTIME;
  void ask_for_beats() WASP_REALTIME;
  void set_up(TimeNs now_ns, RunStatus& status) WASP_REALTIME;
  void look_at_line() WASP_REALTIME;
  void speak() WASP_REALTIME;
  void note_position(const mavlink::LocalPositionNed& m) WASP_REALTIME;
  void watch_for_sense(TimeNs now_ns) WASP_REALTIME;

  drivers::LinePort& port_;
  drivers::AutopilotLink& autopilot_;
  shm::RingWriter imu_, attitude_, position_;
  shm::RingReader commands_;
  LinkServices services_;
  LineGate gate_;
  Stage *age_, *compute_;
  rt::Seqlock<LinkReport>& report_;
  EventQueue& events_;
  ThreadWatch& watch_;
  drivers::AutopilotSetup setup_;
  SampleFaults faults_;
  LinkReport now_;
  TimeNs received_at_ns_ = 0, timesync_due_ns_ = 0, peer_until_ns_ = 0;
  bool gone_ = false;
  bool heard_ = false;  ///< the autopilot itself spoke in the bytes at hand
  bool heartbeat_seen_ = false;
  drivers::ImuJudge imu_judge_;
  drivers::AttitudeJudge attitude_judge_;
  Told imu_told_, attitude_told_, driver_;
  std::uint64_t implausible_ = 0;  ///< samples refused here
  drivers::LinkCounts seen_;       ///< of the driver, at the last look
  TimeNs opened_at_ns_ = 0, stranger_due_ns_ = 0, clock_due_ns_ = 0;
  bool beats_asked_ = false;
  std::uint16_t refused_command_ = 0;  ///< what was last said of an acknowledgement, and until when it is no news
  std::uint8_t refused_result_ = 0;
  TimeNs refused_until_ns_ = 0;
  std::uint32_t positions_ = 0;
  std::uint64_t bytes_understood_ = 0, frames_understood_ = 0;  ///< of the parser, when a frame last verified
  TimeNs understood_at_ns_ = 0;
  bool sense_missed_ = false;
  std::array<std::uint8_t, 4096> buffer_{};
};

}  // namespace wasp::scheduling
