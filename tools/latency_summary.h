// The stage table copied out of shared memory into plain values, and to and from JSON (log/stages.json). The copy is
// taken while the flight writes: each row is consistent to within the samples recorded during the copy.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "scheduling/stage_table.h"
#include "shm/region.h"

namespace wasp::tools {

/// One stage; durations in ns. `buckets` holds {lower edge, count} of the non-empty ones, rising.
struct StageSummary {
  std::string owner, stage;
  std::uint64_t count = 0, misses = 0;
  std::int64_t budget_ns = 0;  ///< 0: no bound stated
  std::int64_t min_ns = 0, p50_ns = 0, p90_ns = 0, p99_ns = 0, p999_ns = 0, max_ns = 0;
  double mean_ns = 0;
  std::vector<std::pair<std::int64_t, std::uint64_t>> buckets;
};

/// RunStatus by value.
struct RunSummary {
  bool present = false;
  bool real_time = false, preempt_rt = false, armed = false, finished = false;
  std::uint64_t ticks = 0, skipped = 0, deadline_misses = 0, minor_faults = 0, major_faults = 0, frames_lost = 0;
  std::uint64_t bad_frames = 0, link_reconnects = 0;
  std::uint64_t incidents = 0, commands_refused = 0, setpoints_flushed = 0, behaviour_ticks = 0;
  bool faults_armed = false;
  std::uint32_t mission_result = 0;             ///< scheduling::MissionResult
  std::vector<std::uint32_t> behaviour_states;  ///< scheduling::BehaviourState of each behaviour
  std::vector<std::string> behaviours;
  std::string autopilot;  ///< what the check before arming found; empty: none was made
};

/// Block `topic` as a T, nullptr if absent, of another type or too small.
template <class T>
const T* find_block(const shm::Region& region, std::string_view topic, std::string_view type) {
  for (const auto& e : region.topics())
    if (e.name_view() == topic && e.type_view() == type && e.kind == shm::TopicKind::kBlock &&
        sizeof(T) <= e.payload_bytes)
      return reinterpret_cast<const T*>(region.at(e.offset));
  return nullptr;
}

std::vector<StageSummary> read_stages(const shm::Region& flight);
RunSummary read_run(const shm::Region& flight);

/// {"stages": [...], "run": {...}}.
nlohmann::json latency_json(const std::vector<StageSummary>& stages, const RunSummary& run, bool with_buckets);
nlohmann::json run_json(const RunSummary& run);
/// The inverse; missing keys keep their defaults. Throws nlohmann::json::exception on values of the wrong kind.
std::vector<StageSummary> stages_from_json(const nlohmann::json& document);
RunSummary run_from_json(const nlohmann::json& document);

/// "830 ns", "12.4 us", "3.10 ms", "1.20 s".
std::string duration_text(std::int64_t duration_ns);

}  // namespace wasp::tools
