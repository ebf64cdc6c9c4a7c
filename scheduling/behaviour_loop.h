// The adaptor, written once: waits for a frame, calls `step`, publishes the cue, records latency and overruns. A new
// behaviour is one file pair in vision/ and one row in behaviours.cpp.
#pragma once

#include <atomic>

#include "rt/clock.h"
#include "scheduling/frame_source.h"
#include "scheduling/realtime_loop.h"
#include "scheduling/replay_script.h"
#include "shm/topics.h"

namespace wasp::scheduling {

/// Everything an adaptor is wired to; built before arming.
struct BehaviourWiring {
  const shm::Region* camera = nullptr;
  const shm::Region* flight = nullptr;
  std::uint32_t index = 0;  ///< Cue::behaviour
  DurationNs budget_ns = 0;
  bool frames_in_order = false;  ///< every frame in turn while the ring holds it; else the newest
  StageTable* stages = nullptr;
  ThreadWatch* watch = nullptr;             ///< required
  const BehaviourScript* script = nullptr;  ///< replay of a wasp recording: inputs as recorded, frames in order
  std::uint32_t script_ends_at = 0;         ///< first frame sequence of the recording's second lap
  bool attitude_from_link = true;           ///< false in a replay: the simulated vehicle's attitude is not the camera's
  std::atomic<std::uint64_t>* frames_done = nullptr;  ///< replay flow control
};

template <Behaviour B>
class BehaviourLoop {
 public:
  BehaviourLoop(const typename B::Params& params, const BehaviourWiring& wiring)
      : params_(params),
        state_(make_state<B>(params)),
        wiring_(wiring),
        frames_(*wiring.camera, B::kStream),
        attitude_(*wiring.flight, shm::kAttitude, "Attitude"),
        cues_(*wiring.flight, shm::cue_topic(std::string(B::kName)), "Cue"),
        wake_(wiring.stages->add(B::kName, "wake-up", 0)),
        compute_(wiring.stages->add(B::kName, "compute", wiring.budget_ns)) {}

  /// Runs until the stop flag. Real-time loop.
  void run(LoopControl& control) {
    RealtimeLoop loop(control, *wiring_.watch);
    const bool in_order = wiring_.frames_in_order || wiring_.frames_done != nullptr;
    if (wiring_.frames_done != nullptr) frames_.from_the_start();
    while (loop.tick()) cycle(control, in_order);
  }

 private:
  void cycle(LoopControl& control, bool in_order) WASP_REALTIME {
    if (const Frame frame = frames_.wait(rt::now() + 100 * kMillisecond, in_order)) serve(frame);
    if (frames_.lost() == lost_reported_) return;
    control.status->frames_lost.fetch_add(frames_.lost() - lost_reported_);
    lost_reported_ = frames_.lost();
  }

  void serve(const Frame& frame) WASP_REALTIME {
    Cue cue;
    cue.started_at_ns = rt::now();
    wiring_.watch->trace.record(cue.started_at_ns, rt::TraceKind::kFrame, frame.header.sequence,
                                cue.started_at_ns - frame.sample.published_at_ns);
    BehaviourInput input;
    if (gather(frame, input)) {
      wiring_.watch->busy_since_ns.store(cue.started_at_ns, std::memory_order_relaxed);
      cue.body = B::step(params_, input, state_);
      cue.finished_at_ns = rt::now();
      wiring_.watch->busy_since_ns.store(0, std::memory_order_relaxed);
      if (frames_.intact(frame)) publish(frame, input, cue);
    }
    if (wiring_.frames_done != nullptr) wiring_.frames_done->store(frame.sample.number, std::memory_order_release);
  }

  bool gather(const Frame& frame, BehaviourInput& input) WASP_REALTIME {
    input.exposed_at_ns = frame.header.exposed_at_ns;
    input.frame_sequence = frame.header.sequence;
    input.gray = frame.gray;
    input.depth = frame.depth;
    if (wiring_.script != nullptr) {
      const ScriptedStep* step = find_step(*wiring_.script, frame.header.sequence);
      if (step == nullptr) return frame.header.sequence >= wiring_.script_ends_at;  // a later lap: no attitude
      input.exposed_at_ns = step->exposed_at_ns;  // the recording's own time: what the first step was given
      input.attitude_valid = step->attitude_valid;
      input.attitude = step->attitude;
    } else if (wiring_.attitude_from_link) {
      input.attitude_valid = attitude_at(attitude_, input.exposed_at_ns, input.attitude);
    }
    input.attitude.exposed_at_ns = input.exposed_at_ns;
    return true;
  }

  void publish(const Frame& frame, const BehaviourInput& input, Cue& cue) WASP_REALTIME {
    cue.exposed_at_ns = frame.header.exposed_at_ns;
    cue.released_at_ns = frame.sample.published_at_ns;
    cue.behaviour = wiring_.index;
    cue.frame_sequence = input.frame_sequence;
    cue.step_index = steps_++;
    cue.attitude_valid = input.attitude_valid ? 1 : 0;
    cue.q_ned_body = input.attitude.q_ned_body;
    cue.rate_body_radps = input.attitude.rate_body_radps;
    const DurationNs compute_ns = cue.finished_at_ns - cue.started_at_ns;
    cue.over_budget = compute_ns > wiring_.budget_ns ? 1 : 0;
    wake_->record(cue.started_at_ns - cue.released_at_ns);
    compute_->record(compute_ns);
    cues_.write(cue, rt::now());
    hold_against_budget(cue, compute_ns);
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
  shm::RingReader attitude_;
  shm::RingWriter cues_;
  Stage* wake_;
  Stage* compute_;
  std::uint32_t steps_ = 0;
  std::uint64_t lost_reported_ = 0;
};

}  // namespace wasp::scheduling
