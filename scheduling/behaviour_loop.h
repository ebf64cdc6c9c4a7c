// The adaptor, written once: waits for a frame or a flow field, calls `step`, publishes the cue (and the flow field, if
// the behaviour makes one), records latency and overruns. A new behaviour is one file pair in vision/ and one row in
// behaviours.cpp.
#pragma once

#include <atomic>
#include <optional>

#include "rt/clock.h"
#include "scheduling/behaviour_faults.h"
#include "scheduling/frame_source.h"
#include "scheduling/realtime_loop.h"
#include "scheduling/replay_script.h"
#include "scheduling/vehicle_history.h"

namespace wasp::scheduling {

/// Everything an adaptor is wired to; built before arming.
struct BehaviourWiring {
  const shm::Region* camera = nullptr;
  const shm::Region* flight = nullptr;
  std::uint32_t index = 0;  ///< Cue::behaviour
  DurationNs budget_ns = 0;
  bool frames_in_order = false;  ///< every frame in turn while the ring holds it; else the newest
  FrameRules rules = {};         ///< what is held against its frames; nothing in a replay
  StageTable* stages = nullptr;
  ThreadWatch* watch = nullptr;             ///< required
  const BehaviourScript* script = nullptr;  ///< replay of a wasp recording: inputs as recorded, frames in order
  std::uint32_t script_ends_at = 0;         ///< first frame sequence of the recording's second lap
  bool vehicle_from_link = true;            ///< false in a replay: the simulated vehicle's motion is not the camera's
  std::atomic<std::uint64_t>* frames_done = nullptr;  ///< replay flow control
};

template <Behaviour B>
class BehaviourLoop {
 public:
  BehaviourLoop(const typename B::Params& params, const BehaviourWiring& wiring)
      : params_(params),
        state_(make_state<B>(params)),
        wiring_(wiring),
        frames_(*wiring.camera, *wiring.flight, B::kStream, wiring.rules),
        vehicle_(*wiring.flight),
        cues_(*wiring.flight, shm::cue_topic(std::string(B::kName)), "Cue"),
        wake_(wiring.stages->add(B::kName, "wake-up", 0)),
        compute_(wiring.stages->add(B::kName, "compute", wiring.budget_ns)) {
    if constexpr (FlowSource<B>) flow_.emplace(*wiring.flight, ring_of(B::kPublishes));
  }

  /// Runs until the stop flag. Real-time loop.
  void run(LoopControl& control) {
    RealtimeLoop loop(control, *wiring_.watch);
    faults_.use(control, wiring_.index);
    const bool in_order = wiring_.frames_in_order || wiring_.frames_done != nullptr;
    if (wiring_.frames_done != nullptr) frames_.from_the_start();
    while (loop.tick()) cycle(control, in_order);
  }

 private:
  void cycle(LoopControl& control, bool in_order) WASP_REALTIME {
    if (const Frame frame = frames_.wait(rt::now() + 100 * kMillisecond, in_order)) serve(frame);
    report_frames(*control.status);
  }

  /// What was lost or refused since the last call, for all behaviours together.
  void report_frames(RunStatus& status) WASP_REALTIME {
    const auto add = [](std::atomic<std::uint64_t>& word, std::uint64_t now, std::uint64_t& before) noexcept {
      if (now != before) word.fetch_add(now - before, std::memory_order_relaxed);
      before = now;
    };
    const FrameCounts& now = frames_.counts();
    const auto refused = [&](FrameFault fault, std::atomic<std::uint64_t>& word) noexcept {
      add(word, now.of(fault), reported_.refused[static_cast<std::size_t>(fault)]);
    };
    add(status.frames_lost, frames_.lost(), lost_reported_);
    refused(FrameFault::kDuplicate, status.frames_duplicate);
    refused(FrameFault::kDisordered, status.frames_disordered);
    refused(FrameFault::kMalformed, status.frames_malformed);
    refused(FrameFault::kMisdated, status.frames_misdated);
    add(status.frames_stuck, now.frozen, reported_.frozen);
  }

  void serve(const Frame& frame) WASP_REALTIME {
    Cue cue;
    cue.started_at_ns = rt::now();
    wiring_.watch->trace.record(cue.started_at_ns, rt::TraceKind::kFrame, frame.sequence,
                                cue.started_at_ns - frame.sample.published_at_ns);
    BehaviourInput input;
    if (gather(frame, input)) {
      wiring_.watch->busy_since_ns.store(cue.started_at_ns, std::memory_order_relaxed);
      faults_.before(input);
      cue.body = B::step(params_, input, state_);
      faults_.after(cue.body);
      cue.finished_at_ns = rt::now();
      wiring_.watch->busy_since_ns.store(0, std::memory_order_relaxed);
      if (frames_.intact(frame)) {
        publish(frame, input, cue);
        publish_flow(frame);
      }
    }
    if (wiring_.frames_done != nullptr) wiring_.frames_done->store(frame.sample.number, std::memory_order_release);
  }

  bool gather(const Frame& frame, BehaviourInput& input) WASP_REALTIME {
    input.exposed_at_ns = frame.exposed_at_ns;
    input.frame_sequence = frame.sequence;
    input.gray = frame.gray;
    input.depth = frame.depth;
    input.flow = frame.flow;
    if (wiring_.script != nullptr) {
      const ScriptedStep* step = find_step(*wiring_.script, frame.sequence);
      if (step == nullptr) return frame.sequence >= wiring_.script_ends_at;  // a later lap: nothing of the vehicle
      input.exposed_at_ns = step->exposed_at_ns;  // the recording's own time: what the first step was given
      input.attitude_valid = step->attitude_valid;
      input.attitude = step->attitude;
      input.accel_valid = step->accel_valid;
      input.accel_body_mps2 = step->accel_body_mps2;
    } else if (wiring_.vehicle_from_link) {
      input.attitude_valid = vehicle_.attitude(input.exposed_at_ns, input.attitude);
      input.accel_valid = vehicle_.mean_specific_force(input.exposed_at_ns, input.accel_body_mps2);
    }
    input.attitude.exposed_at_ns = input.exposed_at_ns;
    return true;
  }

  void publish(const Frame& frame, const BehaviourInput& input, Cue& cue) WASP_REALTIME {
    cue.exposed_at_ns = faults_.exposure(frame.shown_at_ns);
    cue.released_at_ns = frame.sample.published_at_ns;
    cue.behaviour = wiring_.index;
    cue.frame_sequence = input.frame_sequence;
    cue.step_index = steps_++;
    cue.attitude_valid = input.attitude_valid ? 1 : 0;
    cue.q_ned_body = input.attitude.q_ned_body;
    cue.rate_body_radps = input.attitude.rate_body_radps;
    cue.accel_valid = input.accel_valid ? 1 : 0;
    cue.accel_body_mps2 = input.accel_body_mps2;
    const DurationNs compute_ns = cue.finished_at_ns - cue.started_at_ns;
    cue.over_budget = compute_ns > wiring_.budget_ns ? 1 : 0;
    wake_->record(cue.started_at_ns - cue.released_at_ns);
    compute_->record(compute_ns);
    if (!faults_.silent()) cues_.write(cue, rt::now());
    hold_against_budget(cue, compute_ns);
  }

  /// The field of the step just made, for the behaviours that wait for it.
  void publish_flow(const Frame& frame) WASP_REALTIME {
    if constexpr (FlowSource<B>)
      if (const FlowMessage* flow = B::flow(state_)) flow_->publish(*flow, frame.shown_at_ns, rt::now());
  }

  void hold_against_budget(const Cue& cue, DurationNs compute_ns) WASP_REALTIME {
    ThreadWatch& watch = *wiring_.watch;
    watch.trace.record(cue.finished_at_ns, rt::TraceKind::kCue, cue.frame_sequence, compute_ns);
    const rt::ThreadUsage usage = watch.take_usage();
    if (cue.over_budget == 0) return watch.overruns_in_row.store(0, std::memory_order_relaxed);
    watch.overruns_in_row.fetch_add(1, std::memory_order_relaxed);
    Miss miss;
    miss.kind = MissKind::kOverBudget;
    miss.number = cue.frame_sequence;
    miss.due_at_ns = cue.released_at_ns;
    miss.released_at_ns = cue.started_at_ns;
    miss.computed_at_ns = cue.finished_at_ns;
    miss.late_ns = compute_ns;
    miss.limit_ns = wiring_.budget_ns;
    miss.usage = usage;
    watch.report(miss);
  }

  typename B::Params params_;
  typename B::State state_;
  BehaviourWiring wiring_;
  FrameSource frames_;
  VehicleHistory vehicle_;
  shm::RingWriter cues_;
  std::optional<FlowWriter> flow_;  ///< of a flow source
  BehaviourFaults faults_;
  Stage* wake_;
  Stage* compute_;
  std::uint32_t steps_ = 0;
  std::uint64_t lost_reported_ = 0;
  FrameCounts reported_;
};

}  // namespace wasp::scheduling
