// A flight on virtual time: the simulator, the behaviours' own `step` functions and control_step, in lockstep in one
// thread, many times faster than real time and the same to the bit for the same seed. The bytes between flight and
// autopilot are the same MAVLink bytes as on the wire.
#pragma once

#include <vector>

#include "control/control_step.h"
#include "drivers/autopilot_link.h"
#include "sim/sim_camera.h"
#include "sim/simulator.h"
#include "vision/edge_altitude.h"
#include "vision/ground_altitude.h"

namespace wasp::sim {

struct LockstepOptions {
  SimConfig sim;
  control::ControlParams control;                    ///< arbiter row 0: ground_altitude, row 1: edge_altitude
  DurationNs camera_latency_ns = 25 * kMillisecond;  ///< exposure to cue
  DurationNs control_period_ns = 50 * kMillisecond;
};

/// What a tick left behind.
struct LockstepSample {
  TimeNs at_ns = 0;
  Truth truth;
  Command command;
  CueBody ground, edge;
};

class Lockstep {
 public:
  explicit Lockstep(const LockstepOptions& options);
  /// Flies until the mission is over or `limit_s` of virtual time has passed. Returns one sample a control tick.
  std::vector<LockstepSample> fly(double limit_s);

  // What AutopilotLink::receive calls.
  void on_imu(const ImuSample& sample) noexcept;
  void on_attitude(const AttitudeSample& sample) noexcept { attitudes_.push_back(sample); }
  void on_heartbeat(const drivers::AutopilotStatus& status) noexcept;
  void on_ack(std::uint16_t, std::uint8_t) noexcept {}
  void on_statustext(std::uint8_t, std::string_view) noexcept {}
  void reply(std::span<const std::uint8_t> bytes) noexcept { simulator_.from_companion(bytes); }

 private:
  void exchange(TimeNs now_ns);
  void expose(TimeNs now_ns);
  void deliver_cues(TimeNs now_ns);
  void tick(TimeNs now_ns);
  void send(const control::ControlOutput& output, TimeNs now_ns);
  template <class B>
  Cue step(const typename B::Params& params, typename B::State& state, const BehaviourInput& input,
           std::uint32_t index);

  LockstepOptions options_;
  Simulator simulator_;
  SimCamera camera_;
  drivers::AutopilotLink link_;
  control::ControlState state_;
  control::ControlInput input_;
  vision::GroundAltitude::Params ground_params_;
  vision::GroundAltitude::State ground_state_;
  vision::EdgeAltitude::Params edge_params_;
  vision::EdgeAltitude::State edge_state_;
  std::vector<std::uint8_t> gray_, bytes_;
  std::vector<std::uint16_t> depth_mm_;
  std::vector<AttitudeSample> attitudes_;
  std::vector<Cue> pending_;
  std::vector<LockstepSample> samples_;
  std::array<double, 3> accel_sum_{};
  int accel_count_ = 0;
  std::uint32_t frame_ = 0;
  TimeNs request_due_ns_ = 0, timesync_due_ns_ = 0;
};

}  // namespace wasp::sim
