#include "benchmarks/latency_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "rt/histogram.h"
#include "rt/process.h"

namespace wasp::bench {
namespace {

using tools::duration_text;

std::string time_text(double ns) { return duration_text(static_cast<std::int64_t>(ns)); }

std::string quantiles_text(const tools::Quantiles& q) {
  return fmt::format("n {} p50 {} p99 {} p99.9 {} max {}", q.count, time_text(q.p50), time_text(q.p99),
                     time_text(q.p999), time_text(q.max));
}

std::string setup_text(const PairSetup& s) {
  return fmt::format("{} {}+-{:.2f} ms, priority {:+d}{}", s.cyclictest ? "cyclictest" : "own reference loop",
                     s.real_time ? "" : "SCHED_OTHER, ", static_cast<double>(s.reference_lead_ns) * 1e-6,
                     s.reference_priority - s.control_priority, s.real_time ? "" : "; NOT REAL TIME");
}

std::string miss_text(const Miss& m) {
  return fmt::format("    miss at {:.3f} s: {} {}; the references above control stood still for {} of it: {}\n",
                     to_seconds(m.due_at_ns), m.skipped ? "release skipped, work over after" : "last byte after",
                     duration_text(m.late_ns), duration_text(m.host_ns), m.cause());
}

/// Chains and stages of all pairs of a load together.
struct Pooled {
  std::vector<StageFigures> stages;
  std::vector<std::pair<std::string, Chain>> worst;
};

Pooled pool(const LatencyRun& run, const std::string& load) {
  Pooled p;
  for (const auto& pair : run.pairs) {
    if (pair.setup.load != load) continue;
    for (const auto& b : pair.behaviours) {
      const Chain* worst = b.worst();
      if (worst == nullptr) continue;
      const auto it = std::find_if(p.worst.begin(), p.worst.end(), [&](const auto& w) { return w.first == b.name; });
      if (it == p.worst.end())
        p.worst.emplace_back(b.name, *worst);
      else if (worst->total_ns > it->second.total_ns)
        it->second = *worst;
    }
    for (const auto& s : pair.stages) {
      const auto it = std::find_if(p.stages.begin(), p.stages.end(),
                                   [&](const auto& x) { return x.owner == s.owner && x.stage == s.stage; });
      if (it == p.stages.end()) {
        p.stages.push_back(s);
        continue;
      }
      it->q = {it->q.count + s.q.count, std::max(it->q.p50, s.q.p50), std::max(it->q.p99, s.q.p99),
               std::max(it->q.p999, s.q.p999), std::max(it->q.max, s.q.max)};
    }
  }
  return p;
}

std::string chain_text(const std::string& name, const Chain& chain) {
  std::string text = fmt::format("  worst end to end, {}: {}\n    =", name, duration_text(chain.total_ns));
  for (std::size_t i = 0; i < kChainParts.size(); ++i)
    text += fmt::format("{} {} {}", i == 0 ? "" : " +", kChainParts[i], duration_text(chain.part_ns[i]));
  return text + "\n";
}

nlohmann::json json_of(const tools::Quantiles& q) {
  return {{"count", q.count}, {"p50_ns", q.p50}, {"p99_ns", q.p99}, {"p999_ns", q.p999}, {"max_ns", q.max}};
}

/// [[lower edge, count], ...] of the log-linear buckets (rt/histogram.h), whole population.
nlohmann::json histogram_json(const std::vector<std::int64_t>& samples_ns) {
  std::map<std::uint64_t, std::uint64_t> buckets;
  for (const auto ns : samples_ns)
    ++buckets[rt::Histogram::bucket_low(
        rt::Histogram::bucket_of(static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0))))];
  auto rows = nlohmann::json::array();
  for (const auto& [low, count] : buckets) rows.push_back({low, count});
  return rows;
}

nlohmann::json chain_json(const Chain& c) {
  nlohmann::json j{{"exposed_at_ns", c.exposed_at_ns}, {"total_ns", c.total_ns}};
  for (std::size_t i = 0; i < kChainParts.size(); ++i) j["parts_ns"][kChainParts[i]] = c.part_ns[i];
  return j;
}

nlohmann::json pair_json(const PairFigures& p) {
  nlohmann::json j{
      {"load", p.setup.load},
      {"pair", p.setup.index},
      {"reference", p.setup.cyclictest ? "cyclictest" : "own loop"},
      {"real_time", p.setup.real_time},
      {"core", p.setup.core},
      {"control_priority", p.setup.control_priority},
      {"reference_priority", p.setup.reference_priority},
      {"reference_lead_ns", p.setup.reference_lead_ns},
      {"control", json_of(p.q_ours)},
      {"cyclictest", json_of(p.q_theirs)},
      {"witness", json_of(p.q_witness)},
      {"skipped_releases", {{"control", p.ours.skipped}, {"cyclictest", p.theirs.skipped}}},
      {"unobserved", p.ours.unobserved},
      {"lost_by_the_observer", p.lost},
      {"ratio", {{"p50", p.ratio_p50}, {"p99", p.ratio_p99}, {"p999", p.ratio_p999}, {"max", p.ratio_max}}},
      {"judgeable", p.judgeable},
      {"foreign_real_time_threads", p.foreign},
      {"minor_faults", p.minor_faults},
      {"major_faults", p.major_faults},
      {"misses", nlohmann::json::array()},
      {"stages", nlohmann::json::array()},
      {"worst_chains", nlohmann::json::object()},
      {"histogram", {{"control", histogram_json(p.ours.late_ns)}, {"cyclictest", histogram_json(p.theirs.late_ns)}}}};
  for (const auto& m : p.misses)
    j["misses"].push_back({{"due_at_ns", m.due_at_ns},
                           {"late_ns", m.late_ns},
                           {"skipped", m.skipped},
                           {"host_ns", m.host_ns},
                           {"host_noise", m.host_noise},
                           {"cause", m.cause()}});
  for (const auto& s : p.stages) {
    auto row = json_of(s.q);
    row["owner"] = s.owner;
    row["stage"] = s.stage;
    j["stages"].push_back(std::move(row));
  }
  for (const auto& b : p.behaviours)
    if (const Chain* worst = b.worst()) j["worst_chains"][b.name] = chain_json(*worst);
  return j;
}

}  // namespace

std::string pair_text(const PairFigures& p) {
  std::string text =
      fmt::format("{:<7} pair {} ({})\n  control    {}\n  reference  {}\n", p.setup.load, p.setup.index + 1,
                  setup_text(p.setup), quantiles_text(p.q_ours), quantiles_text(p.q_theirs));
  text += fmt::format(
      "  ratio      p50 {:.2f} p99 {:.2f} p99.9 {:.2f} max {:.2f}; misses {}, skipped {} (reference {})\n", p.ratio_p50,
      p.ratio_p99, p.ratio_p999, p.ratio_max, p.misses.size(), p.ours.skipped, p.theirs.skipped);
  if (p.lost + p.ours.unobserved > 0)
    text += fmt::format("  the observer was too late for {} messages\n", p.lost + p.ours.unobserved);
  for (const auto& m : p.misses) text += miss_text(m);
  for (const auto& f : p.foreign)
    text += fmt::format("    not ours, real-time, on core {} at control's priority or above: {}\n", p.setup.core, f);
  return text;
}

std::string load_text(const LatencyRun& run, const LoadVerdict& v) {
  const Pooled pooled = pool(run, v.load);
  std::string text = fmt::format(
      "{}: every stage, whole population; quantiles are the worst pair's\n  {:<18} {:<14} {:>8} {:>9} {:>9} {:>9} "
      "{:>9}\n",
      v.load, "owner", "stage", "n", "p50", "p99", "p99.9", "max");
  for (const auto& s : pooled.stages)
    text += fmt::format("  {:<18} {:<14} {:>8} {:>9} {:>9} {:>9} {:>9}\n", s.owner, s.stage, s.q.count,
                        time_text(s.q.p50), time_text(s.q.p99), time_text(s.q.p999), time_text(s.q.max));
  for (const auto& [name, chain] : pooled.worst) text += chain_text(name, chain);
  for (const auto& r : v.results)
    text += fmt::format("  {:<4} {:<66} {:>8.3f} {:<2}{}\n",
                        r.bar.empty() ? ""
                        : r.ok        ? "ok"
                                      : "MISS",
                        r.name, r.value, r.unit, r.bar.empty() ? "" : "bar " + r.bar);
  if (v.judgeable_pairs == 0)
    text +=
        "  in every pair the reference itself exceeded the slack, or another real-time program shared the core: this\n"
        "  machine cannot judge deadlines now\n";
  return text;
}

nlohmann::json latency_run_json(const LatencyRun& run) {
  nlohmann::json j{{"kernel", rt::kernel_description()},
                   {"host", rt::host_description()},
                   {"seconds_a_pair", run.seconds},
                   {"bars_apply", run.binding},
                   {"ok", all_met(run)},
                   {"pairs", nlohmann::json::array()},
                   {"loads", nlohmann::json::array()}};
  for (const auto& p : run.pairs) j["pairs"].push_back(pair_json(p));
  for (const auto& v : run.verdicts) {
    nlohmann::json load{{"load", v.load},
                        {"misses", v.misses},
                        {"host_noise", v.host_noise},
                        {"judgeable_pairs", v.judgeable_pairs},
                        {"misses_in_judgeable_pairs", v.misses_in_judgeable},
                        {"results", nlohmann::json::array()}};
    for (const auto& r : v.results) load["results"].push_back(tools::to_json(r));
    j["loads"].push_back(std::move(load));
  }
  return j;
}

bool all_met(const LatencyRun& run) {
  return std::all_of(run.verdicts.begin(), run.verdicts.end(), [](const LoadVerdict& v) {
    return std::all_of(v.results.begin(), v.results.end(), [](const tools::Result& r) { return r.ok; });
  });
}

}  // namespace wasp::bench
