// wasp bench micro, fault points that are off: what a flight pays that was started without them. Each path beside the
// same without any point, in alternating blocks of one run; `ratio` is the median over the pairs of blocks.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "control/control_step.h"
#include "rt/clock.h"
#include "scheduling/behaviour_faults.h"
#include "scheduling/control_loop.h"
#include "scheduling/sample_faults.h"
#include "shm/broadcast_ring.h"

namespace wasp::bench {
namespace {

using scheduling::BehaviourFaults;
using scheduling::FaultBoard;
using scheduling::SampleFaults;

constexpr int kBlock = 200;

template <class Path>
double block_ns(Path& path) {
  const TimeNs begin_ns = rt::now();
  for (int i = 0; i < kBlock; ++i) path();
  return static_cast<double>(rt::now() - begin_ns) / kBlock;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Either path in turn, the first of a pair alternately.
template <class With, class Without>
void in_pairs(benchmark::State& state, With&& with, Without&& without) {
  std::vector<double> ratios, with_ns, without_ns;
  bool with_first = false;
  for (auto _ : state) {
    with_first = !with_first;
    double a = with_first ? block_ns(with) : 0;
    const double b = block_ns(without);
    if (!with_first) a = block_ns(with);
    with_ns.push_back(a);
    without_ns.push_back(b);
    ratios.push_back(a / b);
  }
  state.counters["with_ns"] = median(with_ns);
  state.counters["without_ns"] = median(without_ns);
  state.counters["ratio"] = median(ratios);
}

/// The question alone: a branch on a null pointer.
void fault_point_off(benchmark::State& state) {
  const FaultBoard* board = nullptr;
  for (auto _ : state) {
    benchmark::DoNotOptimize(board);
    benchmark::DoNotOptimize(scheduling::fault_on(board, scheduling::FaultPoint::kControlStall, 1));
  }
}
BENCHMARK(fault_point_off);

/// The same loop without the question.
void fault_point_absent(benchmark::State& state) {
  const FaultBoard* board = nullptr;
  for (auto _ : state) {
    benchmark::DoNotOptimize(board);
    benchmark::DoNotOptimize(false);
  }
}
BENCHMARK(fault_point_absent);

/// And where a board exists, all of it off: only in a flight with faults.
void fault_point_on_board_off(benchmark::State& state) {
  const auto board = std::make_unique<FaultBoard>();
  const FaultBoard* p = board.get();
  for (auto _ : state) {
    benchmark::DoNotOptimize(p);
    benchmark::DoNotOptimize(scheduling::fault_on(p, scheduling::FaultPoint::kControlStall, 1));
  }
}
BENCHMARK(fault_point_on_board_off);

/// An inertial sample on its way into its ring.
void fault_points_off_sample(benchmark::State& state) {
  const std::string name = "wasp.bench." + std::to_string(getpid()) + ".faults";
  const auto region = shm::Region::create(
      name, std::vector<shm::TopicSpec>{{"ring", "", shm::TopicKind::kRing, shm::kPage / 64, sizeof(ImuSample)}});
  shm::RingWriter ring(region, "ring");
  SampleFaults faults;
  ImuSample received;
  TimeNs now_ns = 1;
  in_pairs(
      state,
      [&] {
        benchmark::DoNotOptimize(faults);
        ImuSample sample = received;
        if (!faults.pass(sample, ++now_ns)) return;
        ring.write(sample, now_ns);
      },
      [&] {
        benchmark::DoNotOptimize(faults);
        ring.write(received, ++now_ns);
      });
  shm::Region::remove(name);
}
BENCHMARK(fault_points_off_sample);

/// A step as short as none of ours is: the mean of 64 pixels.
CueBody short_step(const BehaviourInput& input) noexcept {
  int sum = 0;
  for (int u = 0; u < input.gray.width_px; ++u) sum += input.gray.row(0)[u];
  CueBody body;
  body.height_m = static_cast<float>(sum);
  return body;
}

/// Around a step: inputs, cue, its exposure, whether it is said.
void fault_points_off_behaviour(benchmark::State& state) {
  std::vector<std::uint8_t> pixels(64, 1);
  BehaviourInput input;
  input.gray = {pixels.data(), 64, 1, 64};
  BehaviourFaults faults;
  Cue cue;
  in_pairs(
      state,
      [&] {
        benchmark::DoNotOptimize(faults);
        benchmark::DoNotOptimize(input);
        cue.started_at_ns = rt::now();
        faults.before(input);
        cue.body = short_step(input);
        faults.after(cue.body);
        cue.finished_at_ns = rt::now();
        cue.exposed_at_ns = faults.exposure(1);
        if (!faults.silent()) benchmark::DoNotOptimize(cue);
      },
      [&] {
        benchmark::DoNotOptimize(faults);
        benchmark::DoNotOptimize(input);
        cue.started_at_ns = rt::now();
        cue.body = short_step(input);
        cue.finished_at_ns = rt::now();
        cue.exposed_at_ns = 1;
        benchmark::DoNotOptimize(cue);
      });
}
BENCHMARK(fault_points_off_behaviour);

/// A control tick's arithmetic, and the hook between it and the write.
void fault_points_off_control(benchmark::State& state) {
  control::ControlParams params;
  params.arbiter.behaviour_count = 1;
  control::ControlState control_state;
  control::ControlInput input;
  input.now_ns = kSecond;
  scheduling::ControlHook hook;
  in_pairs(
      state,
      [&] {
        benchmark::DoNotOptimize(hook);
        benchmark::DoNotOptimize(control::control_step(params, input, control_state));
        if (hook.before_write != nullptr) hook.before_write(hook.context, 1);
      },
      [&] {
        benchmark::DoNotOptimize(hook);
        benchmark::DoNotOptimize(control::control_step(params, input, control_state));
      });
}
BENCHMARK(fault_points_off_control);

}  // namespace
}  // namespace wasp::bench
