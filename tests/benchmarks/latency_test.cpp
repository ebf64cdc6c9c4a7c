// The arithmetic of `wasp bench latency` on made-up flights: populations, blame, chains, verdicts.
#include <gtest/gtest.h>

#include <numeric>

#include "benchmarks/latency_foreign.h"
#include "benchmarks/latency_judge.h"

namespace wasp::bench {
namespace {

constexpr DurationNs kPeriod = 50 * kMillisecond;
constexpr DurationNs kUs = kMicrosecond;

/// A tick that woke `late_ns` after its due time, computed for 20 us and wrote for 10 us.
Tick tick(std::uint64_t index, DurationNs late_ns, DurationNs compute_ns = 20 * kUs) {
  Tick t;
  t.value.tick = index;
  t.value.due_at_ns = static_cast<TimeNs>(index + 1) * kPeriod;
  t.value.released_at_ns = t.value.due_at_ns + late_ns;
  t.value.computed_at_ns = t.value.released_at_ns + compute_ns;
  t.value.written_at_ns = t.value.computed_at_ns + 10 * kUs;
  t.value.sent = 1;
  t.at_ns = t.value.written_at_ns + 5 * kUs;
  return t;
}

TEST(LatencyMisses, SpansOfReferencesCountOnce) {
  const std::vector<tools::Wakeup> a = {{100, 50}, {200, 10}}, b = {{120, 100}};
  EXPECT_EQ(stalled_ns({&a}, 0, 1000), 60);
  EXPECT_EQ(stalled_ns({&a, &b}, 0, 1000), 120);  // 100..220
  EXPECT_EQ(stalled_ns({&a, &b}, 110, 130), 20);
  EXPECT_EQ(stalled_ns({}, 0, 1000), 0);
}

TEST(LatencyMisses, AStallTheWitnessSharesIsHostNoise) {
  const std::vector<Tick> ticks = {tick(0, 5 * kUs), tick(1, 15 * kMillisecond), tick(2, 5 * kUs)};
  const TimeNs due = ticks[1].value.due_at_ns;
  const std::vector<tools::Wakeup> saw = {{due + 5 * kMillisecond, 10 * kMillisecond}};
  const std::vector<tools::Wakeup> saw_not = {{due + 5 * kMillisecond, 30 * kUs}};
  auto misses = find_misses(ticks, {}, {&saw});
  ASSERT_EQ(misses.size(), 1u);
  EXPECT_TRUE(misses[0].host_noise);
  EXPECT_EQ(misses[0].host_ns, 10 * kMillisecond);
  misses = find_misses(ticks, {}, {&saw_not});
  ASSERT_EQ(misses.size(), 1u);
  EXPECT_TRUE(misses[0].woken_late);
  EXPECT_STREQ(misses[0].cause(),
               "woken late, though the host ran: another real-time thread, or the kernel, held the core");
  EXPECT_FALSE(misses[0].host_noise);
}

TEST(LatencyMisses, AStallTooShortToExplainTheMissIsNoExcuse) {
  const std::vector<Tick> ticks = {tick(0, 10 * kUs, 25 * kMillisecond), tick(1, 5 * kUs)};
  const std::vector<tools::Wakeup> saw = {{ticks[0].value.due_at_ns + 5 * kMillisecond, 10 * kMillisecond}};
  const auto misses = find_misses(ticks, {}, {&saw});
  ASSERT_EQ(misses.size(), 1u);
  EXPECT_STREQ(misses[0].cause(), "control's own work");
  EXPECT_FALSE(misses[0].host_noise);  // 25 ms of work less 10 ms of stall are still 15 ms
}

TEST(LatencyMisses, SkippedReleasesAreMissesOfTheirOwn) {
  // Tick 0 comes back after 130 ms: releases 1 and 2 are skipped, 3 is served.
  const std::vector<Tick> ticks = {tick(0, 130 * kMillisecond), tick(3, 5 * kUs)};
  const std::vector<tools::Wakeup> host = {{ticks[0].value.due_at_ns, 130 * kMillisecond}};
  auto misses = find_misses(ticks, {}, {});
  ASSERT_EQ(misses.size(), 3u);
  EXPECT_EQ(std::count_if(misses.begin(), misses.end(), [](const Miss& m) { return m.skipped; }), 2);
  EXPECT_TRUE(std::none_of(misses.begin(), misses.end(), [](const Miss& m) { return m.host_noise; }));
  misses = find_misses(ticks, {}, {&host});
  EXPECT_TRUE(std::all_of(misses.begin(), misses.end(), [](const Miss& m) { return m.host_noise; }));
}

TEST(LatencyMisses, ATickNobodyObservedIsNoMiss) {
  EXPECT_TRUE(find_misses({tick(0, 5 * kUs), tick(2, 5 * kUs)}, {}, {}).empty());
}

TEST(LatencyMisses, OnlyReferencesAboveControlAreTrusted) {
  PairData pair;
  pair.setup.control_priority = 80;
  pair.setup.witness_priority = 90;
  pair.setup.reference_priority = 79;
  pair.reference.resize(2);
  EXPECT_EQ(trusted_references(pair).size(), 1u);
  pair.setup.reference_priority = 81;
  EXPECT_EQ(trusted_references(pair).size(), 3u);
}

SeenCue cue(TimeNs exposed_at_ns) {
  SeenCue c;
  c.value.exposed_at_ns = exposed_at_ns;
  c.value.released_at_ns = exposed_at_ns + 8 * kMillisecond;
  c.value.started_at_ns = c.value.released_at_ns + 30 * kUs;
  c.value.finished_at_ns = c.value.started_at_ns + 500 * kUs;
  c.at_ns = c.value.finished_at_ns + 2 * kUs;
  return c;
}

TEST(LatencyChain, PartsAddUpAndACueCountsOnce) {
  const std::vector<Tick> ticks = {tick(0, 5 * kUs), tick(1, 5 * kUs), tick(2, 5 * kUs)};
  const std::vector<SeenCue> cues = {cue(10 * kMillisecond), cue(30 * kMillisecond), cue(120 * kMillisecond)};
  const auto b = follow_cues("b", ticks, cues);
  ASSERT_EQ(b.chains.size(), 2u);  // the first cue is passed over by the second; the second serves two ticks
  EXPECT_EQ(b.age_ns.size(), 3u);
  EXPECT_EQ(b.chains[0].exposed_at_ns, 30 * kMillisecond);
  for (const auto& c : b.chains)
    EXPECT_EQ(std::accumulate(c.part_ns.begin(), c.part_ns.end(), DurationNs{0}), c.total_ns);
  EXPECT_EQ(b.worst()->total_ns, ticks[2].value.written_at_ns - 120 * kMillisecond);
  EXPECT_EQ(follow_cues("none", ticks, {}).worst(), nullptr);
}

TEST(LatencyChain, ACueThatComesBetweenDueAndRunningWaitsForNobody) {
  const std::vector<Tick> ticks = {tick(0, 3 * kMillisecond)};
  const auto b = follow_cues("b", ticks, {cue(ticks[0].value.due_at_ns - 8 * kMillisecond)});
  ASSERT_EQ(b.chains.size(), 1u);
  EXPECT_EQ(b.chains[0].part_ns[3], 0);
  EXPECT_GT(b.chains[0].part_ns[4], 0);
}

/// 1000 ticks at `ours_ns`, a reference beside them at `theirs_ns`.
PairData pair_of(DurationNs ours_ns, DurationNs theirs_ns) {
  PairData p;
  p.setup.load = "idle";
  p.reference.resize(2);  // two halves
  for (std::uint64_t i = 0; i < 1000; ++i) {
    p.ticks.push_back(tick(i, ours_ns));
    p.reference[i / 500].push_back({p.ticks.back().value.due_at_ns + kMillisecond, theirs_ns});
  }
  return p;
}

TEST(LatencyJudge, RatiosOfAPair) {
  const auto f = judge_pair(pair_of(30 * kUs, 20 * kUs));
  EXPECT_EQ(f.q_ours.count, 1000u);
  EXPECT_EQ(f.q_theirs.count, 1000u);
  EXPECT_DOUBLE_EQ(f.ratio_p99, 1.5);
  EXPECT_DOUBLE_EQ(f.ratio_max_allowed, 0);  // within the 0.2 ms allowed to the maximum
  EXPECT_TRUE(f.judgeable);
  EXPECT_TRUE(f.misses.empty());
  EXPECT_EQ(f.stages.back().stage, "tick to byte");
}

TEST(LatencyJudge, AReferenceBeyondTheSlackMakesAPairUnjudgeable) {
  auto data = pair_of(30 * kUs, 20 * kUs);
  data.reference[1][50].late_ns = 9 * kMillisecond;
  EXPECT_FALSE(judge_pair(data).judgeable);
  data.reference.clear();
  EXPECT_FALSE(judge_pair(data).judgeable);
}

TEST(LatencyJudge, SomebodyElsesRealTimeThreadMakesAPairUnjudgeable) {
  auto data = pair_of(30 * kUs, 20 * kUs);
  data.foreign.insert("hog (80)");
  EXPECT_FALSE(judge_pair(data).judgeable);
}

TEST(LatencyForeign, ThreadsAreReadFromTheirStat) {
  std::string line = "12 (a (b) c) S 7";
  for (int field = 5; field < 39; ++field) line += " 0";
  const ThreadStat t = parse_thread_stat(line + " 3 80 1 0");
  EXPECT_EQ(t.name, "a (b) c");
  EXPECT_EQ(t.parent, 7);
  EXPECT_EQ(t.core, 3);
  EXPECT_EQ(t.rt_priority, 80);
  EXPECT_EQ(parse_thread_stat("12 (a) S 7").core, -1);
  EXPECT_EQ(parse_thread_stat("").rt_priority, 0);
}

TEST(LatencyJudge, MediansAreJudgedAndOnlyWhenBinding) {
  const auto good = judge_pair(pair_of(20 * kUs, 20 * kUs)), bad = judge_pair(pair_of(90 * kUs, 20 * kUs));
  const auto all_ok = [](const LoadVerdict& v) {
    return std::all_of(v.results.begin(), v.results.end(), [](const tools::Result& r) { return r.ok; });
  };
  EXPECT_TRUE(all_ok(judge_load({&good, &bad, &good}, true)));
  EXPECT_FALSE(all_ok(judge_load({&good, &bad, &bad}, true)));
  EXPECT_TRUE(all_ok(judge_load({&bad, &bad, &bad}, false)));
}

TEST(LatencyJudge, AMissInACalmRunIsAlwaysABarMissed) {
  auto data = pair_of(20 * kUs, 20 * kUs);
  data.ticks[400] = tick(400, 20 * kMillisecond);
  const auto f = judge_pair(data);
  const auto v = judge_load({&f}, false);
  EXPECT_EQ(v.misses, 1u);
  EXPECT_EQ(v.host_noise, 0u);
  EXPECT_EQ(v.misses_in_judgeable, 1u);
  EXPECT_FALSE(v.results.back().ok);
}

}  // namespace
}  // namespace wasp::bench
