// wasp bench micro, fault points that are off: what a flight pays that was started without them. Each path beside the
// same without any point, in alternating blocks of one run; `ratio` is the median over the pairs of blocks.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "benchmarks/micro_pairs.h"
#include "drivers/autopilot_link.h"
#include "messages/frame_encoder.h"
#include "messages/mavlink_messages.h"
#include "scheduling/behaviour_faults.h"
#include "scheduling/sample_faults.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"

namespace wasp::bench {
namespace {

using scheduling::BehaviourFaults;
using scheduling::FaultBoard;
using scheduling::SampleFaults;

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

/// What LinkLoop does with the samples of a frame; the others are not sent.
class Sink {
 public:
  Sink(const shm::Region& region, bool with) : ring_(region, "ring"), with_(with) {}
  void on_imu(const ImuSample& received) noexcept {
    if (!with_) {
      ring_.write(received, ++now_ns_);
      return;
    }
    ImuSample sample = received;
    if (faults_.pass(sample, ++now_ns_)) ring_.write(sample, now_ns_);
  }
  void on_attitude(const AttitudeSample&) noexcept {}
  void on_heartbeat(const drivers::AutopilotStatus&) noexcept {}
  void on_ack(std::uint16_t, std::uint8_t) noexcept {}
  void on_statustext(std::uint8_t, std::string_view) noexcept {}
  void reply(std::span<const std::uint8_t>) noexcept {}
  SampleFaults& faults() { return faults_; }

 private:
  shm::RingWriter ring_;
  SampleFaults faults_;
  TimeNs now_ns_ = 1;
  bool with_;
};

/// An inertial sample, from the serial line's bytes into its ring.
void fault_points_off_sample(benchmark::State& state) {
  const std::string name = "wasp.bench." + std::to_string(getpid()) + ".faults";
  const auto region = shm::Region::create(
      name, std::vector<shm::TopicSpec>{{"ring", "", shm::TopicKind::kRing, shm::kImuSlots, sizeof(ImuSample)}});
  std::array<std::uint8_t, mavlink::kMaxFrame> wire;
  mavlink::HighresImu imu;
  imu.time_usec = 1;
  imu.zacc = -9.81f;
  mavlink::Encoder encoder(1, mavlink::mav_component::kCompIdAutopilot1);
  const std::span<const std::uint8_t> bytes(wire.data(), encoder.encode(imu, wire));
  drivers::AutopilotLink link;
  Sink with(region, true), without(region, false);
  const auto receive = [&](Sink& sink) {
    benchmark::DoNotOptimize(sink.faults());
    link.receive(bytes, kSecond, sink);
  };
  in_pairs(
      state, [&] { receive(with); }, [&] { receive(without); });
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

}  // namespace
}  // namespace wasp::bench
