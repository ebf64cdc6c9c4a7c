#include "tools/latency_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "shm/topics.h"

namespace wasp::tools {
namespace {

StageSummary summarise(const scheduling::Stage& row) {
  StageSummary s;
  s.owner = row.owner_view();
  s.stage = row.stage_view();
  s.budget_ns = row.budget_ns;
  s.misses = row.misses.load(std::memory_order_relaxed);
  const rt::Histogram& h = row.histogram;
  s.count = h.count();
  s.min_ns = h.min_ns();
  s.mean_ns = h.mean_ns();
  s.max_ns = h.max_ns();
  s.p50_ns = h.quantile_ns(0.50);
  s.p90_ns = h.quantile_ns(0.90);
  s.p99_ns = h.quantile_ns(0.99);
  s.p999_ns = h.quantile_ns(0.999);
  for (std::size_t i = 0; i < rt::Histogram::kBuckets; ++i)
    if (const std::uint64_t n = h.bucket(i); n != 0)
      s.buckets.emplace_back(static_cast<std::int64_t>(rt::Histogram::bucket_low(i)), n);
  return s;
}

std::string text_of(const std::array<char, 32>& text) {
  return {text.begin(), std::find(text.begin(), text.end(), '\0')};
}

nlohmann::json stage_json(const StageSummary& s, bool with_buckets) {
  nlohmann::json row = {{"owner", s.owner},     {"stage", s.stage},   {"count", s.count},         {"min_ns", s.min_ns},
                        {"mean_ns", s.mean_ns}, {"p50_ns", s.p50_ns}, {"p90_ns", s.p90_ns},       {"p99_ns", s.p99_ns},
                        {"p999_ns", s.p999_ns}, {"max_ns", s.max_ns}, {"budget_ns", s.budget_ns}, {"misses", s.misses}};
  if (with_buckets) row["buckets"] = s.buckets;
  return row;
}

StageSummary stage_from_json(const nlohmann::json& row) {
  StageSummary s;
  s.owner = row.value("owner", "");
  s.stage = row.value("stage", "");
  s.count = row.value("count", s.count);
  s.min_ns = row.value("min_ns", s.min_ns);
  s.mean_ns = row.value("mean_ns", s.mean_ns);
  s.p50_ns = row.value("p50_ns", s.p50_ns);
  s.p90_ns = row.value("p90_ns", s.p90_ns);
  s.p99_ns = row.value("p99_ns", s.p99_ns);
  s.p999_ns = row.value("p999_ns", s.p999_ns);
  s.max_ns = row.value("max_ns", s.max_ns);
  s.budget_ns = row.value("budget_ns", s.budget_ns);
  s.misses = row.value("misses", s.misses);
  s.buckets = row.value("buckets", s.buckets);
  return s;
}

}  // namespace

std::vector<StageSummary> read_stages(const shm::Region& flight) {
  std::vector<StageSummary> rows;
  const auto* table = find_block<scheduling::StageTable>(flight, shm::kStages, "StageTable");
  if (table == nullptr) return rows;
  const std::size_t n = std::min<std::size_t>(table->count.load(std::memory_order_acquire), table->stages.size());
  for (std::size_t i = 0; i < n; ++i) rows.push_back(summarise(table->stages[i]));
  return rows;
}

RunSummary read_run(const shm::Region& flight) {
  RunSummary s;
  const auto* run = find_block<scheduling::RunStatus>(flight, "run", "RunStatus");
  if (run == nullptr) return s;
  constexpr auto kRelaxed = std::memory_order_relaxed;
  s.present = true;
  s.finished = run->finished.load(std::memory_order_acquire) == 1;
  s.real_time = run->real_time.load(kRelaxed) != 0;
  s.preempt_rt = run->preempt_rt.load(kRelaxed) != 0;
  s.armed = run->armed.load(kRelaxed) != 0;
  s.ticks = run->ticks.load(kRelaxed);
  s.skipped = run->skipped.load(kRelaxed);
  s.deadline_misses = run->deadline_misses.load(kRelaxed);
  s.minor_faults = run->minor_faults.load(kRelaxed);
  s.major_faults = run->major_faults.load(kRelaxed);
  s.frames_lost = run->frames_lost.load(kRelaxed);
  s.bad_frames = run->bad_frames.load(kRelaxed);
  s.link_reconnects = run->link_reconnects.load(kRelaxed);
  s.incidents = run->incidents.load(kRelaxed);
  s.commands_refused = run->commands_refused.load(kRelaxed);
  s.setpoints_flushed = run->setpoints_flushed.load(kRelaxed);
  s.behaviour_ticks = run->behaviour_ticks.load(kRelaxed);
  s.faults_armed = run->faults_armed.load(kRelaxed) != 0;
  s.mission_result = run->mission_result.load(kRelaxed);
  for (const auto& letter : run->autopilot)
    if (const char c = letter.load(kRelaxed); c != '\0') s.autopilot += c;
  const std::size_t n = std::min<std::size_t>(run->behaviour_count.load(kRelaxed), run->behaviours.size());
  for (std::size_t i = 0; i < n; ++i) {
    s.behaviours.push_back(text_of(run->behaviours[i]));
    s.behaviour_states.push_back(run->behaviour_state[i].load(kRelaxed));
  }
  return s;
}

nlohmann::json run_json(const RunSummary& s) {
  if (!s.present) return nullptr;
  return {{"real_time", s.real_time},
          {"preempt_rt", s.preempt_rt},
          {"armed", s.armed},
          {"finished", s.finished},
          {"ticks", s.ticks},
          {"skipped", s.skipped},
          {"deadline_misses", s.deadline_misses},
          {"minor_faults", s.minor_faults},
          {"major_faults", s.major_faults},
          {"frames_lost", s.frames_lost},
          {"bad_frames", s.bad_frames},
          {"link_reconnects", s.link_reconnects},
          {"incidents", s.incidents},
          {"commands_refused", s.commands_refused},
          {"setpoints_flushed", s.setpoints_flushed},
          {"behaviour_ticks", s.behaviour_ticks},
          {"faults_armed", s.faults_armed},
          {"mission_result", s.mission_result},
          {"autopilot", s.autopilot},
          {"behaviour_states", s.behaviour_states},
          {"behaviours", s.behaviours}};
}

nlohmann::json latency_json(const std::vector<StageSummary>& stages, const RunSummary& run, bool with_buckets) {
  nlohmann::json document = {{"stages", nlohmann::json::array()}, {"run", run_json(run)}};
  for (const auto& s : stages) document["stages"].push_back(stage_json(s, with_buckets));
  return document;
}

std::vector<StageSummary> stages_from_json(const nlohmann::json& document) {
  std::vector<StageSummary> rows;
  if (document.contains("stages"))
    for (const auto& row : document.at("stages")) rows.push_back(stage_from_json(row));
  return rows;
}

RunSummary run_from_json(const nlohmann::json& document) {
  RunSummary s;
  if (!document.contains("run") || !document.at("run").is_object()) return s;
  const auto& run = document.at("run");
  s.present = true;
  s.real_time = run.value("real_time", false);
  s.preempt_rt = run.value("preempt_rt", false);
  s.armed = run.value("armed", false);
  s.finished = run.value("finished", false);
  s.ticks = run.value("ticks", s.ticks);
  s.skipped = run.value("skipped", s.skipped);
  s.deadline_misses = run.value("deadline_misses", s.deadline_misses);
  s.minor_faults = run.value("minor_faults", s.minor_faults);
  s.major_faults = run.value("major_faults", s.major_faults);
  s.frames_lost = run.value("frames_lost", s.frames_lost);
  s.bad_frames = run.value("bad_frames", s.bad_frames);
  s.link_reconnects = run.value("link_reconnects", s.link_reconnects);
  s.incidents = run.value("incidents", s.incidents);
  s.commands_refused = run.value("commands_refused", s.commands_refused);
  s.setpoints_flushed = run.value("setpoints_flushed", s.setpoints_flushed);
  s.behaviour_ticks = run.value("behaviour_ticks", s.behaviour_ticks);
  s.faults_armed = run.value("faults_armed", false);
  s.mission_result = run.value("mission_result", s.mission_result);
  s.behaviour_states = run.value("behaviour_states", s.behaviour_states);
  s.behaviours = run.value("behaviours", s.behaviours);
  s.autopilot = run.value("autopilot", s.autopilot);
  return s;
}

std::string duration_text(std::int64_t ns) {
  const auto v = static_cast<double>(ns);
  const auto three = [](double x) { return fmt::format("{:.{}f}", x, x >= 100 ? 0 : x >= 10 ? 1 : 2); };
  if (v < 1e3) return fmt::format("{} ns", ns);
  if (v < 1e6) return three(v * 1e-3) + " us";
  if (v < 1e9) return three(v * 1e-6) + " ms";
  return three(v * 1e-9) + " s";
}

}  // namespace wasp::tools
