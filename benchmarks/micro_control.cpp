// wasp bench micro, control: one tick of the whole control path in flight, cue present; the same while it holds.
#include <benchmark/benchmark.h>

#include "control/control_step.h"

namespace wasp::bench {
namespace {

control::ControlParams params() {
  control::ControlParams p;
  p.arbiter.behaviour_count = 2;
  p.arbiter.rows[0].height_rank = 0;
  p.arbiter.rows[1].height_rank = 1;
  p.mission.leg_count = 1;
  p.mission.legs[0] = {0.5f, 1e9f};
  return p;
}

control::ControlInput input_at(TimeNs now_ns, bool cue_present) {
  control::ControlInput in;
  in.now_ns = now_ns;
  in.attitude_present = in.accel_present = true;
  in.attitude.exposed_at_ns = now_ns;
  in.accel_body_mps2 = {0, 0, -9.81f};
  in.autopilot = {now_ns, true, true};
  for (std::size_t i = 0; i < 2; ++i) {
    in.cues.present[i] = cue_present;
    in.cues.cues[i].exposed_at_ns = now_ns - 40 * kMillisecond;
    in.cues.cues[i].body.validity = Validity::kValid;
    in.cues.cues[i].body.has_height = 1;
    in.cues.cues[i].body.height_m = 0.5f;
    in.cues.cues[i].body.height_sigma_m = 0.01f;
  }
  return in;
}

void control_tick(benchmark::State& state, bool cue_present) {
  const control::ControlParams p = params();
  control::ControlState s;
  TimeNs now_ns = kSecond;
  control::ControlInput first = input_at(now_ns, true);
  first.autopilot.armed = first.autopilot.follows = false;
  control::control_step(p, first, s);
  for (int i = 0; i < 100; ++i) control::control_step(p, input_at(now_ns += 50 * kMillisecond, true), s);
  control::ControlInput in = input_at(now_ns, cue_present);
  for (auto _ : state) {
    in.now_ns += 50 * kMillisecond;
    in.attitude.exposed_at_ns = in.autopilot.heard_at_ns = in.now_ns;
    for (std::size_t i = 0; i < 2; ++i) in.cues.cues[i].exposed_at_ns = in.now_ns - 40 * kMillisecond;
    benchmark::DoNotOptimize(control::control_step(p, in, s));
  }
}

void control_step_in_flight(benchmark::State& state) { control_tick(state, true); }
void control_step_without_cues(benchmark::State& state) { control_tick(state, false); }
BENCHMARK(control_step_in_flight);
BENCHMARK(control_step_without_cues);

}  // namespace
}  // namespace wasp::bench
