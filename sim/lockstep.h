// A flight on virtual time: the simulator, the behaviours' own `step` functions and control_step, in lockstep in one
// thread, many times faster than real time and the same to the bit for the same seed. The bytes between flight and
// autopilot are the same MAVLink bytes as on the wire.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "control/control_step.h"
#include "drivers/autopilot_link.h"
#include "drivers/autopilot_setup.h"
#include "sim/sim_camera.h"
#include "sim/simulator.h"
#include "types/behaviour.h"

namespace wasp::sim {

/// What a step gave; `flow` is set by flow sources and lives until their next step.
struct LockstepCue {
  CueBody body;
  const FlowMessage* flow = nullptr;
};

/// One behaviour to fly with. `index` is its row in the arbiter; one of them runs for each `index`.
struct LockstepBehaviour {
  std::uint32_t index = 0;
  Stream stream = Stream::kGray;
  std::optional<Stream> publishes;
  std::function<LockstepCue(const BehaviourInput&)> step;
};

/// Behaviour B as row `index`, with a state of its own.
template <Behaviour B>
LockstepBehaviour lockstep_behaviour(std::uint32_t index, const typename B::Params& params) {
  LockstepBehaviour b{index, B::kStream, std::nullopt, {}};
  if constexpr (FlowSource<B>) b.publishes = B::kPublishes;
  b.step = [params, state = std::make_shared<typename B::State>(make_state<B>(params))](const BehaviourInput& input) {
    LockstepCue cue{B::step(params, input, *state), nullptr};
    if constexpr (FlowSource<B>) cue.flow = B::flow(*state);
    return cue;
  };
  return b;
}

struct LockstepOptions {
  SimConfig sim;
  control::ControlParams control;
  std::vector<LockstepBehaviour> behaviours;         ///< flow sources before those that read their flow
  DurationNs camera_latency_ns = 25 * kMillisecond;  ///< exposure to cue
  DurationNs control_period_ns = 50 * kMillisecond;
};

/// What a control tick left behind.
struct LockstepSample {
  TimeNs at_ns = 0;
  Truth truth;
  Command command;
};

struct LockstepLog {
  std::vector<LockstepSample> samples;
  std::vector<Cue> cues;       ///< in the order in which they reached control
  std::vector<ImuSample> imu;  ///< as the companion heard it, 200 Hz
  std::uint64_t frames = 0;    ///< exposures of the front camera
};

class Lockstep {
 public:
  /// Builds the world (about a second) and the cameras. Throws what they throw.
  explicit Lockstep(const LockstepOptions& options);
  /// Flies until the mission is over, `limit_s` of virtual time has passed, or `enough` (if given) says so of a tick.
  LockstepLog fly(double limit_s, const std::function<bool(const LockstepSample&)>& enough = {});

  // What AutopilotLink::receive calls.
  void on_imu(const ImuSample& sample) noexcept;
  void on_attitude(const AttitudeSample& sample) noexcept {
    attitudes_.push_back(sample);
    setup_.on_attitude(simulator_.now_ns());
  }
  void on_frame(const mavlink::Frame& frame) noexcept { setup_.on_frame(frame); }
  void on_heartbeat(const drivers::AutopilotStatus& status) noexcept;
  void on_ack(std::uint16_t, std::uint8_t) noexcept {}
  void on_statustext(std::uint8_t, std::string_view) noexcept {}
  void reply(std::span<const std::uint8_t> bytes) noexcept { simulator_.from_companion(bytes); }

 private:
  void exchange(TimeNs now_ns);
  void ask(TimeNs now_ns);
  void expose_front(TimeNs now_ns);
  void expose_down(TimeNs now_ns);
  void step_all(bool down, BehaviourInput input);
  const FlowMessage* step_one(const LockstepBehaviour& behaviour, BehaviourInput& input);
  void match_inertial(TimeNs since_ns, BehaviourInput& input) const;
  void deliver_cues(TimeNs now_ns);
  void tick(TimeNs now_ns);
  void send(const control::ControlOutput& output, TimeNs now_ns);

  LockstepOptions options_;
  Simulator simulator_;
  std::shared_ptr<WorldScene> scene_;
  SimCamera front_;
  std::optional<SimCamera> down_;
  drivers::AutopilotLink link_;
  drivers::AutopilotSetup setup_;  ///< asks an autopilot of another flavour (sim.flavour) what it needs
  control::ControlState state_;
  control::ControlInput input_;
  std::vector<std::uint8_t> gray_, gray_down_, bytes_;
  std::vector<std::uint16_t> depth_mm_;
  std::deque<AttitudeSample> attitudes_;
  std::deque<ImuSample> imu_;          ///< of the last second, for the frames
  std::vector<TimeNs> stepped_at_ns_;  ///< exposure of each behaviour's last step
  std::deque<Cue> pending_;
  LockstepLog log_;
  std::array<double, 3> accel_sum_{};
  control::PressureMean pressure_;
  int accel_count_ = 0;
  std::uint32_t frame_ = 0, down_frame_ = 0;
  TimeNs request_due_ns_ = 0, timesync_due_ns_ = 0, streaming_since_ns_ = kNever;
};

}  // namespace wasp::sim
