// wasp bench micro, control: one tick of the whole control path in flight, cue present; the same while it holds.
#include <benchmark/benchmark.h>

#include "benchmarks/micro_pairs.h"
#include "control/control_step.h"
#include "scheduling/control_loop.h"

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
  in.autopilot = {now_ns, true, true, {}};
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

/// A vehicle in flight, one tick at a time.
class Flight {
 public:
  explicit Flight(bool cue_present) {
    TimeNs now_ns = kSecond;
    control::ControlInput first = input_at(now_ns, true);
    first.autopilot.armed = first.autopilot.follows = false;
    control::control_step(params_, first, state_);
    for (int i = 0; i < 100; ++i) control::control_step(params_, input_at(now_ns += 50 * kMillisecond, true), state_);
    input_ = input_at(now_ns, cue_present);
  }
  void tick() {
    input_.now_ns += 50 * kMillisecond;
    input_.attitude.exposed_at_ns = input_.autopilot.heard_at_ns = input_.now_ns;
    for (std::size_t i = 0; i < 2; ++i) input_.cues.cues[i].exposed_at_ns = input_.now_ns - 40 * kMillisecond;
    benchmark::DoNotOptimize(control::control_step(params_, input_, state_));
  }

 private:
  control::ControlParams params_ = params();
  control::ControlState state_;
  control::ControlInput input_;
};

void control_step_in_flight(benchmark::State& state) {
  Flight flight(true);
  for (auto _ : state) flight.tick();
}
BENCHMARK(control_step_in_flight);

void control_step_without_cues(benchmark::State& state) {
  Flight flight(false);
  for (auto _ : state) flight.tick();
}
BENCHMARK(control_step_without_cues);

/// The hook between a tick's arithmetic and its write, which only a flight with fault points has.
void fault_points_off_control(benchmark::State& state) {
  Flight flight(true);
  scheduling::ControlHook hook;
  in_pairs(
      state,
      [&] {
        flight.tick();
        benchmark::DoNotOptimize(hook);
        if (hook.before_write != nullptr) hook.before_write(hook.context, 1);
      },
      [&] {
        flight.tick();
        benchmark::DoNotOptimize(hook);
      });
}
BENCHMARK(fault_points_off_control);

}  // namespace
}  // namespace wasp::bench
