// wasp bench observers: observers killed and frozen beside a writer (benchmarks/observers_killed.h), as figures.
#include "benchmarks/bench.h"
#include "benchmarks/child.h"
#include "benchmarks/observers_killed.h"
#include "benchmarks/report.h"
#include "rt/process.h"

namespace wasp::bench {
namespace {

void compare(Report& report, const std::string& name, const std::vector<std::int64_t>& spared,
             const std::vector<std::int64_t>& tormented) {
  const Quantiles without = quantiles(spared), with = quantiles(tormented);
  report.row("spared." + name, without);
  report.row("tormented." + name, with);
  report.figure(name + ".ratio.p50", with.p50 / without.p50, "1");
  report.figure(name + ".ratio.p99", with.p99 / without.p99, "1");
}

}  // namespace

int run_observers(const Options& options) {
  catch_interrupts();
  Report report(options.json);
  report.note("machine", rt::host_description() + ", Linux " + rt::kernel_description() + ", gcc " + __VERSION__);
  report.note("placement", choose_placement().description());
  const KillResult r = torment_observers({.kills = options.kills});
  if (!r.trouble.empty()) {
    report.note("observers", r.trouble);
    return 2;
  }
  compare(report, "message", r.spared.message_ns, r.tormented.message_ns);
  compare(report, "frame", r.spared.frame_ns, r.tormented.frame_ns);
  compare(report, "wake_up", r.spared.late_ns, r.tormented.late_ns);
  const auto number = [](std::uint64_t n) { return static_cast<double>(n); };
  report.figure("observers.killed", number(r.deaths), "1", std::to_string(r.freezes) + " frozen");
  report.figure("messages.published", number(r.published), "1");
  report.figure("messages.accepted", number(r.accepted), "1", "by all observers");
  report.figure("messages.dropped", number(r.dropped), "1", "found overwritten after use");
  report.bar("messages.torn", number(r.torn), "1", 0);
  report.bar("messages.backwards", number(r.backwards), "1", 0);
  report.bar("slots.leaked", number(r.slots_leaked), "1", 0, "of " + std::to_string(r.slots));
  return report.met() ? 0 : 1;
}

}  // namespace wasp::bench
