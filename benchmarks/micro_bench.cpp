// wasp bench micro: one operation at a time, alone on one core, with Google Benchmark.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "benchmarks/bench.h"
#include "rt/clock.h"
#include "rt/histogram.h"
#include "rt/seqlock.h"
#include "rt/spsc_queue.h"
#include "shm/broadcast_ring.h"
#include "types/messages.h"

namespace wasp::bench {
namespace {

/// A region of one ring that is gone when the benchmark is over.
class OneRing {
 public:
  explicit OneRing(std::uint64_t payload_bytes)
      : region_(shm::Region::create(
            kName, std::vector<shm::TopicSpec>{{"ring", "", shm::TopicKind::kRing, 8, payload_bytes}})) {}
  ~OneRing() { shm::Region::remove(kName); }
  [[nodiscard]] const shm::Region& region() const { return region_; }

 private:
  static inline const std::string kName = "wasp.bench." + std::to_string(getpid()) + ".micro";
  shm::Region region_;
};

void clock_now(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(rt::now());
}
BENCHMARK(clock_now);

void histogram_record(benchmark::State& state) {
  const auto h = std::make_unique<rt::Histogram>();
  DurationNs v = 1;
  for (auto _ : state) h->record(v = (v * 7) & 0xfffff);
}
BENCHMARK(histogram_record);

void histogram_quantile(benchmark::State& state) {
  const auto h = std::make_unique<rt::Histogram>();
  for (DurationNs v = 1; v < 1'000'000; v += 97) h->record(v);
  for (auto _ : state) benchmark::DoNotOptimize(h->quantile_ns(0.999));
}
BENCHMARK(histogram_quantile);

void seqlock_store(benchmark::State& state) {
  const auto lock = std::make_unique<rt::Seqlock<ImuSample>>();
  const ImuSample sample{};
  for (auto _ : state) lock->store(sample);
}
BENCHMARK(seqlock_store);

void seqlock_load(benchmark::State& state) {
  const auto lock = std::make_unique<rt::Seqlock<ImuSample>>();
  ImuSample sample{};
  lock->store(sample);
  for (auto _ : state) benchmark::DoNotOptimize(lock->load(sample));
}
BENCHMARK(seqlock_load);

void spsc_push_pop(benchmark::State& state) {
  const auto queue = std::make_unique<rt::SpscQueue<ImuSample, 64>>();
  ImuSample sample{};
  for (auto _ : state) {
    benchmark::DoNotOptimize(queue->push(sample));
    benchmark::DoNotOptimize(queue->pop(sample));
  }
}
BENCHMARK(spsc_push_pop);

void ring_write_imu(benchmark::State& state) {
  const OneRing ring(sizeof(ImuSample));
  shm::RingWriter writer(ring.region(), "ring");
  const ImuSample sample{};
  for (auto _ : state) writer.write(sample, 1);
}
BENCHMARK(ring_write_imu);

void ring_copy_newest_imu(benchmark::State& state) {
  const OneRing ring(sizeof(ImuSample));
  shm::RingWriter writer(ring.region(), "ring");
  ImuSample sample{};
  writer.write(sample, 1);
  const shm::RingReader reader(ring.region(), "ring");
  for (auto _ : state) benchmark::DoNotOptimize(reader.copy_newest(sample));
}
BENCHMARK(ring_copy_newest_imu);

void ring_publish_frame_in_place(benchmark::State& state) {
  const OneRing ring(kFramePixelOffset + 640 * 480);
  shm::RingWriter writer(ring.region(), "ring");
  for (auto _ : state) {
    benchmark::DoNotOptimize(writer.loan());
    writer.publish(1);
  }
}
BENCHMARK(ring_publish_frame_in_place);

void bell_ring_without_sleepers(benchmark::State& state) {
  rt::Bell bell;
  for (auto _ : state) bell.ring();
}
BENCHMARK(bell_ring_without_sleepers);

}  // namespace

int run_micro(const Options& options) {
  std::string program = "wasp-bench micro",
              format = options.json ? "--benchmark_format=json" : "--benchmark_format=console";
  std::string least = "--benchmark_min_time=" + std::to_string(options.seconds / 40);
  char* arguments[] = {program.data(), format.data(), least.data(), nullptr};
  int count = 3;
  benchmark::Initialize(&count, arguments);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

}  // namespace wasp::bench
