#include "benchmarks/latency_chain.h"

#include <algorithm>

namespace wasp::bench {
namespace {

Chain chain_of(const Cue& cue, const Command& command) {
  Chain c;
  c.exposed_at_ns = cue.exposed_at_ns;
  c.total_ns = command.written_at_ns - cue.exposed_at_ns;
  const TimeNs ready = std::max(cue.finished_at_ns, command.due_at_ns);  // a cue that came between due and running
  c.part_ns = {cue.released_at_ns - cue.exposed_at_ns,
               cue.started_at_ns - cue.released_at_ns,
               cue.finished_at_ns - cue.started_at_ns,
               ready - cue.finished_at_ns,
               command.released_at_ns - ready,
               command.computed_at_ns - command.released_at_ns,
               command.written_at_ns - command.computed_at_ns};
  return c;
}

template <class Rows, class Value>
StageFigures stage(const std::string& owner, const char* name, const Rows& rows, Value&& value) {
  std::vector<std::int64_t> all;
  for (const auto& row : rows)
    if (const auto v = value(row); v != kNever) all.push_back(v);
  return {owner, name, tools::quantiles(std::move(all))};
}

}  // namespace

const Chain* BehaviourChains::worst() const {
  const auto it = std::max_element(chains.begin(), chains.end(),
                                   [](const Chain& a, const Chain& b) { return a.total_ns < b.total_ns; });
  return it == chains.end() ? nullptr : &*it;
}

BehaviourChains follow_cues(const std::string& name, const std::vector<Tick>& ticks, const std::vector<SeenCue>& cues) {
  BehaviourChains b{name, {}, {}};
  std::size_t next = 0;
  TimeNs last_used = kNever;
  for (const Tick& tick : ticks) {
    const Command& command = tick.value;
    while (next < cues.size() && cues[next].at_ns <= command.released_at_ns) ++next;
    if (next == 0) continue;
    const Cue& cue = cues[next - 1].value;
    b.age_ns.push_back(command.released_at_ns - cue.exposed_at_ns);
    if (command.written_at_ns == 0 || cue.exposed_at_ns == last_used) continue;
    b.chains.push_back(chain_of(cue, command));
    last_used = cue.exposed_at_ns;
  }
  return b;
}

std::vector<StageFigures> stage_figures(const std::vector<Tick>& ticks, const std::vector<BehaviourChains>& behaviours,
                                        const std::vector<std::vector<SeenCue>>& cues) {
  std::vector<StageFigures> all;
  for (std::size_t i = 0; i < behaviours.size(); ++i) {
    const BehaviourChains& b = behaviours[i];
    all.push_back(stage(b.name, "wake-up", cues[i],
                        [](const SeenCue& c) { return c.value.started_at_ns - c.value.released_at_ns; }));
    all.push_back(stage(b.name, "compute", cues[i],
                        [](const SeenCue& c) { return c.value.finished_at_ns - c.value.started_at_ns; }));
    all.push_back(stage(b.name, "age at use", b.age_ns, [](std::int64_t age) { return age; }));
    all.push_back(stage(b.name, "end to end", b.chains, [](const Chain& c) { return c.total_ns; }));
  }
  const auto written = [](const Tick& t, TimeNs since) {
    return t.value.written_at_ns == 0 ? kNever : t.value.written_at_ns - since;
  };
  all.push_back(
      stage("control", "wake-up", ticks, [](const Tick& t) { return t.value.released_at_ns - t.value.due_at_ns; }));
  all.push_back(stage("control", "compute", ticks,
                      [](const Tick& t) { return t.value.computed_at_ns - t.value.released_at_ns; }));
  all.push_back(stage("control", "write", ticks, [&](const Tick& t) { return written(t, t.value.computed_at_ns); }));
  all.push_back(stage("control", "tick to byte", ticks, [&](const Tick& t) { return written(t, t.value.due_at_ns); }));
  return all;
}

}  // namespace wasp::bench
