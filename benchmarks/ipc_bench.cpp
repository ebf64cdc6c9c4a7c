// wasp bench ipc: a 640x480 mono8 frame from one process to another through wasp's ring and through iceoryx, in the
// same run, in interleaved blocks: each repeat runs every mode of both, one after the other, in fresh processes.
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>

#include "benchmarks/bench.h"
#include "benchmarks/child.h"
#include "benchmarks/ipc_observers.h"
#include "benchmarks/ipc_run.h"
#include "benchmarks/ipc_victims.h"
#include "benchmarks/report.h"
#include "rt/process.h"
#include "shm/region.h"
#include "tools/roudi_process.h"

namespace wasp::bench {
namespace {

constexpr int kRepeats = 9;

struct Contender {
  const char* name;
  int (*writer)(const std::string&, Run&);
  int (*reader)(const std::string&, Run&);
  Before before = Before::kNothing;
  bool every_mode = false;  ///< else only where readers are woken, at the full rate
};
constexpr Contender kContenders[] = {
    {"wasp", wasp_writer, wasp_reader, Before::kAnnounce, true},  // as our cameras publish
    {"wasp_unannounced", wasp_writer, wasp_reader},
    {"wasp_rung_twice", wasp_writer, wasp_reader, Before::kRing},
#ifdef WASP_HAVE_ICEORYX
    {"iceoryx", iceoryx_writer, iceoryx_reader, Before::kNothing, true},
#endif
    {"bare_futex", futex_writer, futex_reader},
    {"bare_eventfd", eventfd_writer, eventfd_reader},
    {"pipe", pipe_writer, pipe_reader},
};

struct ModeRow {
  const char* name;
  Mode mode;
  DurationNs period_ns;
  std::uint32_t warm_up;
  double share;              ///< of the time, a block
  double p50_bar, p999_bar;  ///< of the ratio to iceoryx; 0: none
};
constexpr ModeRow kModes[] = {{"woken", Mode::kWoken, 500 * kMicrosecond, kWarmUp, 1, 0.6, 1.0},
                              {"woken_30hz", Mode::kWoken, 33'333 * kMicrosecond, 2, 1.4, 0, 0},
                              {"polled", Mode::kPolled, 500 * kMicrosecond, kWarmUp, 1, 0.3, 0},
                              {"spinning", Mode::kSpinning, 500 * kMicrosecond, kWarmUp, 1, 0, 0}};

/// Ringing twice and the kernel's bare means are measured woken at the full rate only.
bool takes_part(const Contender& contender, const ModeRow& row, bool iceoryx_there) {
  if (!iceoryx_there && contender.name == std::string_view("iceoryx")) return false;
  if (contender.every_mode || row.name == std::string_view("woken")) return true;
  return row.mode == Mode::kWoken && contender.name == std::string_view("wasp_unannounced");
}

/// Samples of one contender in one mode: all, and the median and p99.9 of each repeat.
struct Pool {
  std::vector<std::int64_t> latency_ns;
  std::vector<double> p50, p999;
  DurationNs reader_cpu_ns = 0;
  std::uint64_t frames = 0;
};

Run* shared_run() {
  void* memory = mmap(nullptr, sizeof(Run), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  return memory == MAP_FAILED ? nullptr : new (memory) Run;
}

bool one_block(const Contender& contender, const ModeRow& row, const Placement& placement, Run& run, Pool& pool) {
  const std::string name = "wasp.bench." + std::to_string(getpid()) + ".ipc";
  run.mode = row.mode;
  run.before = contender.before;
  run.period_ns = row.period_ns;
  run.warm_up = row.warm_up;
  run.yields = !placement.two_cores;
  run.reader_ready = run.finished = run.told = 0;
  run.next_due_ns = 0;
  run.received = run.written = 0;
  const pid_t writer = start(placement.writer_core, placement.fifo, [&] { return contender.writer(name, run); });
  const pid_t reader = start(placement.reader_core, placement.fifo, [&] { return contender.reader(name, run); });
  const double patience_s = 30 + 4 * run.frames * to_seconds(run.period_ns);
  const bool written = finish(writer, patience_s);
  run.finished = 1;
  const bool read = finish(reader, written ? 10 : 0);
  shm::Region::remove(name);
  const std::vector<std::int64_t> samples(run.latency_ns.begin(), run.latency_ns.begin() + run.received);
  const Quantiles q = quantiles(samples);
  pool.p50.push_back(q.p50);
  pool.p999.push_back(q.p999);
  pool.latency_ns.insert(pool.latency_ns.end(), samples.begin(), samples.end());
  pool.reader_cpu_ns += run.reader_cpu_ns;
  pool.frames += run.frames;
  return written && read && !samples.empty() && !interrupted();
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[values.size() / 2];
}

/// Of each repeat: the two were measured one after the other.
std::vector<double> ratios(const std::vector<double>& ours, const std::vector<double>& theirs) {
  std::vector<double> result;
  for (std::size_t i = 0; i < std::min(ours.size(), theirs.size()); ++i) result.push_back(ours[i] / theirs[i]);
  return result;
}

std::string spread(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  char text[64];
  std::snprintf(text, sizeof text, "median of %zu repeats, %.2f to %.2f", values.size(), *low, *high);
  return text;
}

/// The median over the repeats: a host that stands still in one of them does not decide.
void report_ratios(Report& report, const ModeRow& row, const Pool& ours, const Pool& theirs, const std::string& name,
                   bool judged) {
  const auto ratio = [&](const char* what, const std::vector<double>& values, double bar) {
    const std::string line = name + "." + what;
    if (judged && bar > 0)
      report.bar(line, median(values), "1", bar, spread(values));
    else
      report.figure(line, median(values), "1", spread(values));
  };
  ratio("p50", ratios(ours.p50, theirs.p50), row.p50_bar);
  if (ours.latency_ns.size() > 1000) ratio("p999", ratios(ours.p999, theirs.p999), row.p999_bar);
}

/// Regions of an earlier run that was killed with SIGKILL, the one signal that leaves them behind.
void sweep_up() {
  const std::string prefix = "wasp.bench.";
  for (const std::string& name : shm::Region::list(prefix)) {
    const pid_t owner = std::atoi(name.c_str() + prefix.size());
    if (owner > 0 && kill(owner, 0) != 0 && errno == ESRCH) shm::Region::remove(name);
  }
}

/// Runs the blocks; false if something broke or was interrupted.
bool run_blocks(bool iceoryx_there, const Placement& placement, Run& run, double seconds,
                std::map<std::string, Pool>& pools) {
  double shares = 0;
  for (const ModeRow& row : kModes)
    for (const Contender& c : kContenders) shares += takes_part(c, row, iceoryx_there) ? row.share : 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat)
    for (const ModeRow& row : kModes)
      for (const Contender& c : kContenders) {
        if (!takes_part(c, row, iceoryx_there)) continue;
        const double frames = seconds * row.share / (shares * kRepeats) / to_seconds(row.period_ns);
        run.frames = std::min<std::uint32_t>(static_cast<std::uint32_t>(frames) + 2 * row.warm_up + 1, kMaxFrames);
        if (!one_block(c, row, placement, run, pools[std::string(row.name) + "." + c.name])) return false;
      }
  return true;
}

void report_mode(Report& report, const ModeRow& row, std::map<std::string, Pool>& pools, bool iceoryx_there) {
  const std::string stem = std::string(row.name) + ".";
  for (const Contender& c : kContenders) {
    if (!takes_part(c, row, iceoryx_there)) continue;
    const Pool& pool = pools[stem + c.name];
    report.row(stem + c.name, quantiles(pool.latency_ns));
    if (row.mode == Mode::kWoken)
      report.figure(stem + c.name + ".reader_cpu",
                    static_cast<double>(pool.reader_cpu_ns) / 1000.0 / static_cast<double>(pool.frames), "us",
                    "processor time of the reader, a frame");
  }
  if (!iceoryx_there) return;
  const Pool& theirs = pools[stem + "iceoryx"];
  report_ratios(report, row, pools[stem + "wasp"], theirs, stem + "ratio", true);
  if (row.mode == Mode::kWoken)
    report_ratios(report, row, pools[stem + "wasp_unannounced"], theirs, stem + "ratio_unannounced", false);
}

}  // namespace

int run_ipc(const Options& options) {
  catch_interrupts();
  sweep_up();
  Report report(options.json);
  const Placement placement = choose_placement();
  Run* run = shared_run();
  if (run == nullptr) return 2;
  report.note("machine", rt::host_description() + ", Linux " + rt::kernel_description() + ", gcc " + __VERSION__);
  report.note("placement", placement.description());
  open_kernel_means();

  bool iceoryx_there = false;
#ifdef WASP_HAVE_ICEORYX
  const tools::RoudiProcess roudi({.interrupted = interrupted});
  iceoryx_there = roudi.trouble().empty();
  if (!iceoryx_there) report.note("iceoryx", roudi.trouble() + "; wasp is measured without it");
#else
  report.note("iceoryx", "not there when this was built; wasp is measured without it");
#endif

  std::map<std::string, Pool> pools;
  if (!run_blocks(iceoryx_there, placement, *run, 0.7 * options.seconds, pools)) {
    report.note("ipc", interrupted() ? "interrupted" : "a writer or reader failed");
    return 2;
  }
  for (const ModeRow& row : kModes) report_mode(report, row, pools, iceoryx_there);
  run->before = Before::kNothing;
  run->period_ns = 500 * kMicrosecond;
  run->warm_up = kWarmUp;
  measure_observers(report, placement, *run, 0.15 * options.seconds);
  measure_victims(report, placement, *run, 0.15 * options.seconds);
  if (interrupted()) return 2;
  return report.met() ? 0 : 1;
}

}  // namespace wasp::bench
