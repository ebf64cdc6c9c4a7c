#include "benchmarks/latency_judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace wasp::bench {
namespace {

constexpr double kAllowance_ns = 0.2e6;

double ratio(double ours, double theirs) { return theirs > 0 ? std::max(0.0, ours) / theirs : 0; }

double median_of(const std::vector<const PairFigures*>& pairs, double PairFigures::*figure) {
  std::vector<double> values;
  for (const auto* p : pairs) values.push_back(p->*figure);
  return tools::median(std::move(values));
}

void add(tools::Population& all, const tools::Population& part) {
  all.late_ns.insert(all.late_ns.end(), part.late_ns.begin(), part.late_ns.end());
  all.skipped += part.skipped;
  all.unobserved += part.unobserved;
}

tools::Result barred(const std::string& name, double value, double bar, bool binding) {
  return binding ? tools::at_most(name, value, "x", bar) : tools::Result{name, value, "x", "", true};
}

}  // namespace

PairFigures judge_pair(const PairData& pair) {
  PairFigures f;
  f.setup = pair.setup;
  f.lost = pair.lost;
  f.minor_faults = pair.run.minor_faults;
  f.major_faults = pair.run.major_faults;
  std::vector<Tick> ticks;
  for (const auto& half : pair.reference) {
    if (half.empty()) continue;
    const DurationNs margin_ns = pair.times.period_ns / 2;
    const auto part = ticks_between(pair.ticks, half.front().due_at_ns - margin_ns, half.back().due_at_ns + margin_ns);
    add(f.ours, tools::whole_population(control_wakeups(part), pair.times.period_ns));
    add(f.theirs, tools::whole_population(half, pair.times.period_ns));
    const auto missed = find_misses(part, pair.times, trusted_references(pair));
    f.misses.insert(f.misses.end(), missed.begin(), missed.end());
    ticks.insert(ticks.end(), part.begin(), part.end());
  }
  f.q_ours = tools::quantiles(f.ours.late_ns);
  f.q_theirs = tools::quantiles(f.theirs.late_ns);
  f.q_witness = tools::quantiles(tools::whole_population(pair.witness, pair.times.period_ns).late_ns);
  f.ratio_p50 = ratio(f.q_ours.p50, f.q_theirs.p50);
  f.ratio_p99 = ratio(f.q_ours.p99, f.q_theirs.p99);
  f.ratio_p999 = ratio(f.q_ours.p999, f.q_theirs.p999);
  f.ratio_max = ratio(f.q_ours.max, f.q_theirs.max);
  f.ratio_max_allowed = ratio(f.q_ours.max - kAllowance_ns, f.q_theirs.max);
  f.foreign = pair.foreign;
  f.judgeable =
      f.foreign.empty() && f.q_theirs.count > 0 && f.q_theirs.max < static_cast<double>(pair.times.slack_ns());
  std::vector<std::vector<SeenCue>> cues;
  for (std::size_t i = 0; i < pair.cues.size(); ++i) {
    f.behaviours.push_back(follow_cues(pair.behaviours[i], ticks, pair.cues[i]));
    cues.emplace_back();
    if (!ticks.empty())
      std::copy_if(pair.cues[i].begin(), pair.cues[i].end(), std::back_inserter(cues.back()), [&](const SeenCue& c) {
        return c.at_ns >= ticks.front().value.due_at_ns && c.at_ns <= ticks.back().at_ns;
      });
  }
  f.stages = stage_figures(ticks, f.behaviours, cues);
  return f;
}

LoadVerdict judge_load(const std::vector<const PairFigures*>& pairs, bool binding) {
  LoadVerdict v;
  if (pairs.empty()) return v;
  v.load = pairs.front()->setup.load;
  const std::string over = fmt::format(", median of {} pairs", pairs.size());
  v.results.push_back({"wake-up p50 / reference" + over, median_of(pairs, &PairFigures::ratio_p50), "x", "", true});
  v.results.push_back(
      barred("wake-up p99 / reference" + over, median_of(pairs, &PairFigures::ratio_p99), 1.2, binding));
  v.results.push_back(
      barred("wake-up p99.9 / reference" + over, median_of(pairs, &PairFigures::ratio_p999), 1.2, binding));
  v.results.push_back(barred("(wake-up max - 0.2 ms) / reference max" + over,
                             median_of(pairs, &PairFigures::ratio_max_allowed), 1.5, binding));
  for (const auto* p : pairs) {
    v.misses += p->misses.size();
    for (const Miss& m : p->misses) v.host_noise += m.host_noise ? 1 : 0;
    if (!p->judgeable) continue;
    ++v.judgeable_pairs;
    v.misses_in_judgeable += p->misses.size();
  }
  v.results.push_back({"deadlines missed or skipped", static_cast<double>(v.misses), "", "", true});
  v.results.push_back({"of them host noise", static_cast<double>(v.host_noise), "", "", true});
  const std::string where =
      fmt::format("misses in the {} pairs whose reference stayed below the slack", v.judgeable_pairs);
  if (v.judgeable_pairs > 0)
    v.results.push_back(tools::at_most(where, static_cast<double>(v.misses_in_judgeable), "", 0));
  return v;
}

}  // namespace wasp::bench
