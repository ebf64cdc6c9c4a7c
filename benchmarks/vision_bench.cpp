// wasp bench vision: blocks of calls, ours and each peer's in turn over the same inputs on one core. Every call of a
// peer is divided by our call on the same input in the same block; the ratio is the median of these, its spread that of
// the blocks' medians. Then our kernel alone goes on through all inputs until it has made kTailCalls calls, for p99.9
// and the worst case.
#include "benchmarks/vision_bench.h"

#include <sched.h>
#include <sys/mman.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "benchmarks/bench.h"
#include "benchmarks/child.h"
#include "benchmarks/report.h"
#include "benchmarks/vision_rows.h"
#include "rt/clock.h"
#include "rt/process.h"
#include "rt/thread.h"

namespace wasp::bench {
namespace {

constexpr int kBlocks = 9;
constexpr int kTailCalls = 10'000;
constexpr int kPriority = 50;
constexpr int kMaxBlockCalls = 2'000;

struct Track {
  std::vector<std::int64_t> all_ns;  ///< every timed call
  std::vector<double> ratios;        ///< of each call to ours on the same judged input in the same block
  std::vector<double> other_ratios;  ///< the same on the other inputs
  std::vector<double> block_ratios;  ///< median of `ratios` of each block
};

std::string pin_to_one_core() {
  const int core = rt::nearest_usable_core(CPU_SETSIZE);  // the last one
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(core, &set);
  sched_setaffinity(0, sizeof set, &set);
  sched_param param{};
  param.sched_priority = kPriority;
  const bool fifo = sched_setscheduler(0, SCHED_FIFO, &param) == 0;
  const bool locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  return "one thread on core " + std::to_string(core) + (fifo ? ", SCHED_FIFO 50" : ", SCHED_OTHER (no SCHED_FIFO)") +
         (locked ? ", memory locked" : "");
}

/// Sleeps 2 ms after every 20 ms: the kernel stops a SCHED_FIFO thread for 50 ms that leaves nothing to the others.
/// The first call after a sleep is timed like any other.
void breathe() {
  static TimeNs last = rt::now();
  if (rt::now() - last < 20 * kMillisecond) return;
  rt::sleep_until(rt::now() + 2 * kMillisecond);
  last = rt::now();
}

std::int64_t timed(const std::function<void(int)>& call, int input) {
  breathe();
  const TimeNs start = rt::now();
  call(input);
  return rt::now() - start;
}

/// Calls over the inputs from `first` on until `budget_ns` is spent, at least `least`; returns their times.
std::vector<std::int64_t> run_calls(const VisionRow& row, const std::function<void(int)>& call, int first, int least,
                                    DurationNs budget_ns) {
  const int inputs = static_cast<int>(row.inputs.size());
  std::vector<std::int64_t> times;
  times.reserve(kMaxBlockCalls);
  call(first % inputs);  // warms the caches and whatever the callee keeps
  const TimeNs end = rt::now() + budget_ns;
  for (int i = 0; i < kMaxBlockCalls && (i < least || rt::now() < end); ++i) {
    if (row.fresh) row.fresh((first + i) % inputs);
    times.push_back(timed(call, (first + i) % inputs));
  }
  return times;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[values.size() / 2];
}

/// Call i of either was on input (first + i) mod inputs.
void add_block(Track& track, const VisionRow& row, int first, const std::vector<std::int64_t>& times,
               const std::vector<std::int64_t>& ours) {
  track.all_ns.insert(track.all_ns.end(), times.begin(), times.end());
  const int inputs = static_cast<int>(row.inputs.size());
  std::vector<double> ratios;
  for (std::size_t i = 0; i < std::min(times.size(), ours.size()); ++i) {
    const int input = (first + static_cast<int>(i)) % inputs;
    std::vector<double>& to = !row.judged || row.judged(input) ? ratios : track.other_ratios;
    to.push_back(static_cast<double>(times[i]) / static_cast<double>(std::max<std::int64_t>(ours[i], 1)));
  }
  track.ratios.insert(track.ratios.end(), ratios.begin(), ratios.end());
  if (!ratios.empty()) track.block_ratios.push_back(median(ratios));
}

std::string spread(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  char text[64];
  std::snprintf(text, sizeof text, "blocks %.1f to %.1f", *low, *high);
  return text;
}

/// What one row gave: ours first, then the peers in their order.
struct Outcome {
  std::vector<Track> tracks;
  std::vector<std::int64_t> cold_ns;  ///< the tail's calls where the others were on fresh frames
  std::size_t slowest_input = 0;
  int most_trips = 0;
  std::size_t most_trips_input = 0;
};

/// The slowest input by its best time of all calls: an interrupt cannot name it.
void run_tail(const VisionRow& row, Outcome& outcome) {
  const int inputs = static_cast<int>(row.inputs.size());
  std::vector<std::int64_t> best(row.inputs.size(), INT64_MAX);
  std::vector<std::int64_t>& all = row.fresh ? outcome.cold_ns : outcome.tracks[0].all_ns;
  for (int i = 0; static_cast<int>(all.size()) < kTailCalls || i < 2 * inputs; ++i) {
    const auto input = static_cast<std::size_t>(i % inputs);
    all.push_back(timed(row.ours, i % inputs));
    best[input] = std::min(best[input], all.back());
    if (interrupted()) return;
  }
  outcome.slowest_input = static_cast<std::size_t>(std::max_element(best.begin(), best.end()) - best.begin());
  if (!row.trips) return;
  for (int i = 0; i < inputs; ++i)
    if (const int trips = row.trips(i); trips > outcome.most_trips) {
      outcome.most_trips = trips;
      outcome.most_trips_input = static_cast<std::size_t>(i);
    }
}

Outcome measure(const VisionRow& row, double seconds) {
  Outcome outcome;
  outcome.tracks.resize(1 + row.peers.size());
  const int inputs = static_cast<int>(row.inputs.size());
  for (int i = 0; i < inputs; ++i) row.ours(i);  // whatever it keeps from call to call is there from now on
  const double share = seconds / kBlocks / static_cast<double>(1 + row.peers.size());
  for (int block = 0; block < kBlocks && !interrupted(); ++block) {
    // Each contender goes through the inputs as far as its share of the time takes it, three at least.
    const int first = block * inputs / kBlocks;
    std::vector<std::vector<std::int64_t>> times(outcome.tracks.size());
    int calls = 3;
    for (std::size_t i = row.peers.size(); i > 0; --i) {
      times[i] = run_calls(row, row.peers[i - 1].call, first, 3, from_seconds(share));
      calls = std::max(calls, static_cast<int>(times[i].size()));
    }
    times[0] = run_calls(row, row.ours, first, calls, 0);
    for (std::size_t i = 0; i < times.size(); ++i) add_block(outcome.tracks[i], row, first, times[i], times[0]);
  }
  run_tail(row, outcome);
  return outcome;
}

void report_row(Report& report, const VisionRow& row, const Outcome& outcome) {
  const Track& ours = outcome.tracks[0];
  report.note(row.name, row.what + (row.fresh ? "; frames just read, but in .uncached: fallen out of the caches" : ""));
  report.row(row.name + ".wasp", quantiles(ours.all_ns));
  if (row.fresh) report.row(row.name + ".wasp.uncached", quantiles(outcome.cold_ns));
  for (std::size_t i = 0; i < row.peers.size(); ++i) {
    const VisionPeer& peer = row.peers[i];
    const Track& theirs = outcome.tracks[i + 1];
    report.row(row.name + "." + peer.name, quantiles(theirs.all_ns));
    if (theirs.ratios.empty()) continue;
    const std::string name = row.name + ".ratio." + peer.name;
    if (peer.ratio_bar > 0)
      report.bar_at_least(name, median(theirs.ratios), "1", peer.ratio_bar, spread(theirs.block_ratios));
    else
      report.figure(name, median(theirs.ratios), "1", spread(theirs.block_ratios));
    if (!theirs.other_ratios.empty())
      report.figure(name + ".adversarial", median(theirs.other_ratios), "1", "inputs the bar is not about");
  }
  if (row.floor_us > 0) {
    char text[64];
    std::snprintf(text, sizeof text, "floor %.0f us at 2.8 GHz", row.floor_us);
    report.figure(row.name + ".over_floor", quantiles(ours.all_ns).p50 / (1000 * row.floor_us), "1", text);
  }
  std::string remark = "slowest input " + row.inputs[outcome.slowest_input];
  if (!row.bound.empty()) remark += "; " + row.bound;
  if (row.trips)
    report.figure(row.name + ".most_trips", outcome.most_trips, "1",
                  row.inputs[outcome.most_trips_input] + "; " + remark);
  else
    report.note(row.name + ".bound", remark);
}

/// Rows whose name contains `only`; a maker that throws is named and left out.
std::vector<VisionRow> wanted_rows(Report& report, const VisionData& data, const std::string& only) {
  std::vector<VisionRow> rows;
  for (const VisionRowMaker make : kVisionRowMakers) try {
      for (VisionRow& row : make(data))
        if (row.name.find(only) != std::string::npos) rows.push_back(std::move(row));
    } catch (const std::exception& e) {
      report.note("not measured", e.what());
    }
  return rows;
}

}  // namespace

int run_vision(const Options& options) {
  catch_interrupts();
  cv::setNumThreads(1);
  Report report(options.json);
  report.note("machine", rt::host_description() + ", Linux " + rt::kernel_description() + ", gcc " + __VERSION__);
  report.note("peers", std::string("OpenCV ") + CV_VERSION + ", one thread");
  const VisionData data = make_vision_data();
  report.note("placement", pin_to_one_core());
  const auto made = std::count_if(data.gray.begin(), data.gray.end(), [](const GrayFrame& f) { return !f.real; }) +
                    std::count_if(data.depth.begin(), data.depth.end(), [](const DepthFrame& f) { return !f.real; });
  report.note("frames",
              std::to_string(made) + " made here; real: " + (data.real_used.empty() ? "none" : data.real_used));

  const std::vector<VisionRow> rows = wanted_rows(report, data, options.only);
  if (rows.empty()) {
    report.note("vision", "no kernel's name contains \"" + options.only + "\"");
    return 2;
  }
  for (const VisionRow& row : rows) {
    const Outcome outcome = measure(row, options.seconds / static_cast<double>(rows.size()));
    if (interrupted()) return 2;
    report_row(report, row, outcome);
  }
  return report.met() ? 0 : 1;
}

}  // namespace wasp::bench
