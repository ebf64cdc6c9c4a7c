#include "benchmarks/ipc_victims.h"

#include <unistd.h>

#include <functional>
#include <string>

#include "benchmarks/tormentor.h"
#include "shm/broadcast_ring.h"

namespace wasp::bench {
namespace {

constexpr int kRepeats = 5;

enum class Victim { kBystander, kReader };

shm::Region attach_when_there(const std::string& name) {
  for (;;) try {
      return shm::Region::attach_with_bells(name);
    } catch (const std::exception&) {
      rt::sleep_until(rt::now() + kMillisecond);
    }
}

[[noreturn]] void stand_by(const Run& run) {
  for (;;) rt::sleep_until(rt::now() + run.period_ns);
}

/// Reads every frame in place, woken by the bell.
[[noreturn]] void read_along(const std::string& name) {
  const shm::Region region = attach_when_there(name);
  shm::RingReader ring(region, "gray", "Frame");
  for (std::uint64_t sum = 0;;) {
    if (!ring.wait(rt::now() + 100 * kMillisecond)) continue;
    const shm::Sample sample = ring.next();
    for (std::size_t i = 0; sample && i < kPixels; i += 4096) sum += static_cast<std::uint64_t>(sample.data[i]);
    if (sample && !ring.intact(sample) && sum == 0) continue;
  }
}

/// The reader that must lose nothing: counts through `run.received`, and the lost in `run.told`.
int be_the_witness(const std::string& name, Run& run) {
  const shm::Region region = attach_when_there(name);
  shm::RingReader ring(region, "gray", "Frame");
  run.reader_ready = 1;
  while (run.finished.load() == 0 || ring.newest() > run.received + ring.lost()) {
    ring.wait(rt::now() + 20 * kMillisecond);
    while (const shm::Sample sample = ring.next()) {
      FrameHeader head;
      std::memcpy(&head, sample.data, sizeof head);
      ring.intact(sample) ? static_cast<void>(++run.received) : ring.count_lost();
    }
  }
  run.lost = ring.lost();
  return 0;
}

struct Pool {
  std::vector<std::int64_t> publish_ns, frame_ns;
  std::uint64_t read = 0, lost = 0;
  Torments torments;
};

bool one_block(const Placement& placement, Run& run, Victim victim, unsigned seed, Pool& pool) {
  const std::string name = "wasp.bench." + std::to_string(getpid()) + ".victims";
  run.reader_ready = run.finished = run.told = 0;
  run.written = run.received = 0;
  run.lost = 0;
  const pid_t writer = start(placement.writer_core, placement.fifo, [&] { return wasp_writer(name, run); });
  const pid_t witness = start(placement.reader_core, placement.fifo, [&] { return be_the_witness(name, run); });
  {
    const std::function<pid_t()> along = [&] {
      return start(placement.reader_core, false, [&]() -> int { read_along(name); });
    };
    const std::function<pid_t()> aside = [&] {
      return start(placement.reader_core, false, [&]() -> int { stand_by(run); });
    };
    Torments nothing_done;
    const Tormentor spared(victim == Victim::kReader ? aside : along, seed, nothing_done);
    Tormentor tormented(victim == Victim::kReader ? along : aside, seed, pool.torments);
    const TimeNs limit = rt::now() + from_seconds(30 + 4 * run.frames * to_seconds(run.period_ns));
    while (run.finished.load() == 0 && rt::now() < limit && !interrupted()) {
      rt::sleep_until(rt::now() + 5 * kMillisecond);
      tormented.act();
    }
  }
  const bool ok = finish(writer, 5) && finish(witness, 5);
  shm::Region::remove(name);
  pool.publish_ns.insert(pool.publish_ns.end(), run.publish_ns.begin(), run.publish_ns.begin() + run.written);
  pool.frame_ns.insert(pool.frame_ns.end(), run.frame_ns.begin(), run.frame_ns.begin() + run.written);
  pool.read += run.received;
  pool.lost += run.lost;
  return ok && !interrupted();
}

}  // namespace

void measure_victims(Report& report, const Placement& placement, Run& run, double seconds) {
  const double frames = seconds / (kRepeats * 2) / to_seconds(run.period_ns);
  run.frames = std::min<std::uint32_t>(static_cast<std::uint32_t>(frames) + 2 * run.warm_up, kMaxFrames);
  Pool bystander, reader;
  for (unsigned repeat = 0; repeat < kRepeats; ++repeat) {
    if (!one_block(placement, run, Victim::kBystander, repeat, bystander)) return;
    if (!one_block(placement, run, Victim::kReader, repeat, reader)) return;
  }
  report.row("victims.bystander.publish", quantiles(bystander.publish_ns));
  report.row("victims.reader.publish", quantiles(reader.publish_ns));
  report.row("victims.bystander.frame", quantiles(bystander.frame_ns));
  report.row("victims.reader.frame", quantiles(reader.frame_ns));
  const auto ratio = [&](auto member, double Quantiles::*q) {
    return quantiles(reader.*member).*q / quantiles(bystander.*member).*q;
  };
  const std::string acts =
      std::to_string(reader.torments.deaths) + " killed, " + std::to_string(reader.torments.freezes) + " frozen";
  report.bar("victims.frame.ratio.p50", ratio(&Pool::frame_ns, &Quantiles::p50), "1", 1.05, acts);
  report.figure("victims.frame.ratio.p99", ratio(&Pool::frame_ns, &Quantiles::p99), "1");
  report.figure("victims.publish.ratio.p50", ratio(&Pool::publish_ns, &Quantiles::p50), "1");
  report.figure("victims.publish.ratio.p99", ratio(&Pool::publish_ns, &Quantiles::p99), "1");
  report.bar("victims.frames_lost_to_others", static_cast<double>(reader.lost), "1", 0,
             std::to_string(reader.read) + " read by a reader that stayed");
}

}  // namespace wasp::bench
