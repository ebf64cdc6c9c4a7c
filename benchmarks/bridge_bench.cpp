// wasp bench bridge: one flight in the simulator, in alternating blocks without and with the gateway exporting every
// topic while it, its worker and iceoryx's daemon are killed and frozen at random. The timing of each control tick is
// read from the command ring: intended release, release, last byte.
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include "benchmarks/bench.h"
#include "benchmarks/child.h"
#include "benchmarks/report.h"
#include "rt/clock.h"
#include "rt/process.h"
#include "scheduling/stage_table.h"
#include "shm/broadcast_ring.h"
#include "shm/topics.h"
#include "tools/gateway_chaos.h"
#include "tools/program_paths.h"
#include "types/messages.h"

namespace wasp::bench {
namespace {

constexpr double kBlock_s = 3;
constexpr double kMargin_s = 60;  ///< for start-up, climb and restarts of the daemon

/// Simulator and flight, and a folder for what they say.
class Flying {
 public:
  Flying(const std::string& instance, double seconds)
      : folder_(std::filesystem::temp_directory_path() / instance), instance_(instance) {
    std::filesystem::create_directories(folder_);
    const std::string tty = (folder_ / "tty").string(), settings = (folder_ / "override.toml").string();
    sim_.emplace(std::vector<std::string>{tools::program("wasp-sim"), "--instance", instance, "--tty-link", tty},
                 (folder_ / "sim.txt").string());
    while (!std::filesystem::exists(tty) && !sim_->poll()) rt::sleep_until(rt::now() + 10 * kMillisecond);
    std::ofstream(settings) << fmt::format(
        "[run]\nenforce_real_time = false\n[autopilot]\nendpoint = \"serial:{}:921600\"\n[mission]\nheights_m = "
        "[0.5]\nseconds = [{:.1f}]\npatience_s = 60.0\n",
        tty, seconds);
    std::vector<std::string> flight{tools::program("wasp"),
                                    "flight",
                                    "--instance",
                                    instance,
                                    "--config",
                                    (tools::config_folder() / "wasp.toml").string(),
                                    "--config",
                                    settings};
    real_time_ = rt::missing_rights(80).empty();
    if (!real_time_) flight.push_back("--no-rt");
    flight_.emplace(flight, (folder_ / "flight.txt").string());
  }
  ~Flying() {
    flight_.reset();
    sim_.reset();
    for (const auto& region : {shm::flight_region(instance_), shm::camera_region(instance_)})
      shm::Region::remove(region);
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  Flying(const Flying&) = delete;
  Flying& operator=(const Flying&) = delete;

  [[nodiscard]] bool running() { return !flight_->poll(); }
  [[nodiscard]] bool real_time() const { return real_time_; }
  [[nodiscard]] std::string log(const char* name) const { return (folder_ / name).string(); }

 private:
  std::filesystem::path folder_;
  std::string instance_;
  bool real_time_ = false;
  std::optional<tools::ChildProcess> sim_, flight_;
};

struct Pool {
  std::vector<std::int64_t> wake_ns, byte_ns;
  std::uint64_t skipped = 0, lost = 0;
};

/// Takes every command since the last look; gaps in the tick number are skipped releases.
class TickReader {
 public:
  explicit TickReader(const shm::Region& region) : ring_(region, shm::kCommand, "Command") {}
  void take(Pool* pool) {
    const std::uint64_t lost = ring_.lost();
    for (Command c; ring_.read(c); last_tick_ = c.tick) {
      if (pool == nullptr) continue;
      pool->wake_ns.push_back(c.released_at_ns - c.due_at_ns);
      if (c.written_at_ns > 0) pool->byte_ns.push_back(c.written_at_ns - c.due_at_ns);
      if (last_tick_ != 0 && ring_.lost() == lost) pool->skipped += c.tick - last_tick_ - 1;
    }
    if (pool != nullptr) pool->lost += ring_.lost() - lost;
  }

 private:
  shm::RingReader ring_;
  std::uint64_t last_tick_ = 0;
};

std::optional<shm::Region> await_flight(Flying& flying, const std::string& instance) {
  for (const TimeNs limit = rt::now() + 60 * kSecond; rt::now() < limit && flying.running() && !interrupted();) {
    try {
      shm::Region region = shm::Region::attach(shm::flight_region(instance));
      const auto& entry = region.topic("run");
      if (reinterpret_cast<const scheduling::RunStatus*>(region.at(entry.offset))->ticks > 100) return region;
    } catch (const std::exception&) {
    }
    rt::sleep_until(rt::now() + 100 * kMillisecond);
  }
  return std::nullopt;
}

void one_block(TickReader& ticks, Pool& pool, tools::GatewayChaos* chaos, DurationNs length_ns) {
  ticks.take(nullptr);
  const TimeNs end = rt::now() + length_ns;
  for (TimeNs act_at = rt::now(); rt::now() < end && !interrupted(); ticks.take(&pool)) {
    if (chaos != nullptr && rt::now() >= act_at) {
      chaos->act();
      act_at = rt::now() + 250 * kMillisecond;
    }
    rt::sleep_until(rt::now() + 50 * kMillisecond);
  }
}

void compare(Report& report, const std::string& what, const std::vector<std::int64_t>& without,
             const std::vector<std::int64_t>& with) {
  const Quantiles a = quantiles(without), b = quantiles(with);
  report.row(what + ".without", a);
  report.row(what + ".with", b);
  report.figure(what + ".ratio.p50", b.p50 / a.p50, "1");
  report.bar(what + ".ratio.p99", b.p99 / a.p99, "1", 1.2);
  report.figure(what + ".ratio.max", b.max / a.max, "1");
}

}  // namespace

int run_bridge(const Options& options) {
  catch_interrupts();
  Report report(options.json);
  report.note("machine", rt::host_description() + ", Linux " + rt::kernel_description() + ", gcc " + __VERSION__);
  tools::RoudiProcess daemon({.monitoring = true, .interrupted = interrupted});
  if (!daemon.trouble().empty()) {
    report.note("iceoryx", daemon.trouble());
    return 2;
  }
  const std::string instance = "bench-bridge-" + std::to_string(getpid());
  Flying flying(instance, options.seconds + kMargin_s);
  const auto region = await_flight(flying, instance);
  if (!region) {
    report.note("bridge", interrupted() ? "interrupted" : "the flight did not start");
    return 2;
  }
  report.note("flight", flying.real_time() ? "real time" : "NOT REAL TIME");
  TickReader ticks(*region);
  Pool without, with;
  int kills = 0, freezes = 0;
  const DurationNs block_ns = from_seconds(std::min(kBlock_s, options.seconds / 2));
  const TimeNs end = rt::now() + from_seconds(options.seconds);
  while (rt::now() < end && flying.running() && !interrupted()) {
    one_block(ticks, without, nullptr, block_ns);
    tools::GatewayChaos chaos(daemon, {tools::program("wasp-iceoryx"), "export", "--all", "--instance", instance},
                              flying.log("export.txt"), static_cast<unsigned>(with.wake_ns.size()) + 1);
    one_block(ticks, with, &chaos, block_ns);
    kills += chaos.kills();
    freezes += chaos.freezes();
  }
  if (interrupted() || without.wake_ns.empty() || with.wake_ns.empty()) return 2;
  compare(report, "bridge.wake_up", without.wake_ns, with.wake_ns);
  compare(report, "bridge.tick_to_byte", without.byte_ns, with.byte_ns);
  report.figure("bridge.skipped.without", static_cast<double>(without.skipped), "1", "control releases");
  report.bar("bridge.skipped.with", static_cast<double>(with.skipped), "1", 0,
             fmt::format("control releases; {} kills, {} freezes", kills, freezes));
  const auto* status = reinterpret_cast<const scheduling::RunStatus*>(region->at(region->topic("run").offset));
  report.bar("bridge.frames_lost_to_behaviours", static_cast<double>(status->frames_lost), "1", 0);
  return report.met() ? 0 : 1;
}

}  // namespace wasp::bench
