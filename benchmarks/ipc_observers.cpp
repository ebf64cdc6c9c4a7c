#include "benchmarks/ipc_observers.h"

#include <signal.h>
#include <unistd.h>

#include <map>
#include <string>

#include "shm/broadcast_ring.h"

namespace wasp::bench {
namespace {

constexpr int kRepeats = 5;
constexpr int kCounts[] = {0, 1, 4, 8};

/// Looks every quarter of a period, copies the newest frame if there is one.
[[noreturn]] void observe(const std::string& name, const Run& run) {
  const shm::Region region = [&] {
    for (;;) try {
        return shm::Region::attach(name);
      } catch (const std::exception&) {
        rt::sleep_until(rt::now() + kMillisecond);
      }
  }();
  shm::RingReader ring(region, "gray", "Frame");
  std::vector<std::byte> copy(kFrameBytes);
  for (;;) {
    rt::sleep_until(rt::now() + run.period_ns / 4);
    const shm::Sample sample = ring.latest();
    if (!sample) continue;
    std::memcpy(copy.data(), sample.data, copy.size());
    if (!ring.intact(sample)) ring.count_lost();
  }
}

struct Pool {
  std::vector<std::int64_t> publish_ns, frame_ns;
};

bool one_block(const Placement& placement, Run& run, int observers, Pool& pool) {
  const std::string name = "wasp.bench." + std::to_string(getpid()) + ".observed";
  std::vector<pid_t> children;
  for (int i = 0; i < observers; ++i)
    children.push_back(start(placement.reader_core, false, [&]() -> int { observe(name, run); }));
  run.reader_ready = 1;
  run.finished = 0;
  run.told = 0;
  run.written = 0;
  const bool ok = finish(start(placement.writer_core, placement.fifo, [&] { return wasp_writer(name, run); }), 60);
  for (const pid_t child : children) kill(child, SIGKILL);
  for (const pid_t child : children) finish(child, 5);
  shm::Region::remove(name);
  pool.publish_ns.insert(pool.publish_ns.end(), run.publish_ns.begin(), run.publish_ns.begin() + run.written);
  pool.frame_ns.insert(pool.frame_ns.end(), run.frame_ns.begin(), run.frame_ns.begin() + run.written);
  return ok && !interrupted();
}

}  // namespace

void measure_observers(Report& report, const Placement& placement, Run& run, double seconds) {
  const double frames = seconds / (kRepeats * std::size(kCounts)) / to_seconds(run.period_ns);
  run.frames = std::min<std::uint32_t>(static_cast<std::uint32_t>(frames) + 2 * kWarmUp, kMaxFrames);
  std::map<int, Pool> pools;
  for (int repeat = 0; repeat < kRepeats; ++repeat)
    for (const int observers : kCounts)
      if (!one_block(placement, run, observers, pools[observers])) return;
  for (const int observers : kCounts) {
    const std::string stem = "observers." + std::to_string(observers);
    report.row(stem + ".publish", quantiles(pools[observers].publish_ns));
    report.row(stem + ".frame", quantiles(pools[observers].frame_ns));
  }
  const auto change = [&](auto member) {
    return 100 * (quantiles(pools[8].*member).p50 / quantiles(pools[1].*member).p50 - 1);
  };
  report.bar("observers.seven_more.frame", change(&Pool::frame_ns), "%", 5,
             "loan, 307200 bytes, publish; medians, 8 against 1");
  report.figure("observers.seven_more.publish", change(&Pool::publish_ns), "%", "publish alone; medians, 8 against 1");
}

}  // namespace wasp::bench
