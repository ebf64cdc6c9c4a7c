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

#include "benchmarks/bench.h"
#include "benchmarks/child.h"
#include "benchmarks/ipc_observers.h"
#include "benchmarks/ipc_run.h"
#include "benchmarks/report.h"
#include "rt/process.h"
#include "shm/region.h"
#include "tools/roudi_process.h"

namespace wasp::bench {
namespace {

constexpr int kRepeats = 5;

struct Contender {
  const char* name;
  int (*writer)(const std::string&, Run&);
  int (*reader)(const std::string&, Run&);
};
constexpr Contender kWasp{"wasp", wasp_writer, wasp_reader};
#ifdef WASP_HAVE_ICEORYX
constexpr Contender kIceoryx{"iceoryx", iceoryx_writer, iceoryx_reader};
#endif

struct ModeRow {
  const char* name;
  Mode mode;
  double p50_bar, p999_bar;  ///< of the ratio to iceoryx; 0: none
};
constexpr ModeRow kModes[] = {{"woken", Mode::kWoken, 0.6, 1.0},
                              {"announced", Mode::kAnnounced, 0, 0},
                              {"polled", Mode::kPolled, 0.3, 0},
                              {"spinning", Mode::kSpinning, 0, 0}};

/// Samples of one contender in one mode: all, and the median of each repeat.
struct Pool {
  std::vector<std::int64_t> latency_ns;
  std::vector<double> medians;
};

Run* shared_run() {
  void* memory = mmap(nullptr, sizeof(Run), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  return memory == MAP_FAILED ? nullptr : new (memory) Run;
}

bool one_block(const Contender& contender, Mode mode, const Placement& placement, Run& run, Pool& pool) {
  const std::string name = "wasp.bench." + std::to_string(getpid()) + ".ipc";
  run.mode = mode;
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
  pool.medians.push_back(quantiles(samples).p50);
  pool.latency_ns.insert(pool.latency_ns.end(), samples.begin(), samples.end());
  return written && read && !samples.empty() && !interrupted();
}

std::string spread(const Pool& ours, const Pool& theirs) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < std::min(ours.medians.size(), theirs.medians.size()); ++i)
    ratios.push_back(ours.medians[i] / theirs.medians[i]);
  const auto [low, high] = std::minmax_element(ratios.begin(), ratios.end());
  char text[64];
  std::snprintf(text, sizeof text, "repeats %.2f to %.2f", *low, *high);
  return text;
}

void report_ratios(Report& report, const ModeRow& row, const Pool& ours, const Pool& theirs) {
  const Quantiles a = quantiles(ours.latency_ns), b = quantiles(theirs.latency_ns);
  const auto ratio = [&](const std::string& what, double value, double bar, const std::string& remark) {
    const std::string name = std::string(row.name) + ".ratio." + what;
    bar > 0 ? report.bar(name, value, "1", bar, remark) : report.figure(name, value, "1", remark);
  };
  ratio("p50", a.p50 / b.p50, row.p50_bar, spread(ours, theirs));
  ratio("p999", a.p999 / b.p999, row.p999_bar, {});
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
bool run_blocks(const std::vector<Contender>& contenders, const Placement& placement, Run& run,
                std::map<std::string, Pool>& pools) {
  for (int repeat = 0; repeat < kRepeats; ++repeat)
    for (const ModeRow& row : kModes)
      for (const Contender& contender : contenders)
        if (!one_block(contender, row.mode, placement, run, pools[std::string(row.name) + "." + contender.name]))
          return false;
  return true;
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

  std::vector<Contender> contenders{kWasp};
#ifdef WASP_HAVE_ICEORYX
  const tools::RoudiProcess roudi({.interrupted = interrupted});
  if (roudi.trouble().empty())
    contenders.push_back(kIceoryx);
  else
    report.note("iceoryx", roudi.trouble() + "; wasp is measured alone");
#else
  report.note("iceoryx", "not there when this was built; wasp is measured alone");
#endif

  const double blocks = static_cast<double>(kRepeats * std::size(kModes) * contenders.size());
  const double frames = 0.75 * options.seconds / blocks / to_seconds(run->period_ns);
  run->frames = std::min<std::uint32_t>(static_cast<std::uint32_t>(frames) + 2 * kWarmUp, kMaxFrames);
  std::map<std::string, Pool> pools;
  if (!run_blocks(contenders, placement, *run, pools)) {
    report.note("ipc", interrupted() ? "interrupted" : "a writer or reader failed");
    return 2;
  }
  for (const ModeRow& row : kModes) {
    const std::string stem = row.name;
    for (const Contender& c : contenders)
      report.row(stem + "." + c.name, quantiles(pools[stem + "." + c.name].latency_ns));
    if (contenders.size() > 1) report_ratios(report, row, pools[stem + ".wasp"], pools[stem + ".iceoryx"]);
  }
  measure_observers(report, placement, *run, 0.25 * options.seconds);
  if (interrupted()) return 2;
  return report.met() ? 0 : 1;
}

}  // namespace wasp::bench
