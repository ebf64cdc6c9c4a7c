// What a finished flight is judged by, from its logs: height against the simulator's truth, deadlines, losses.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/latency_summary.h"
#include "tools/result.h"

namespace wasp::tools {

/// A stretch of the flight at one setpoint.
struct Phase {
  std::string name;
  double setpoint_m = 0;
  std::int64_t start_ns = 0, end_ns = 0;
};

/// Runs of constant Command::mission_phase in log/commands.csv.
std::vector<Phase> read_phases(const std::filesystem::path& log);

/// Hover bars of every leg from 5 s after its start: RMS <= 0.03 m, excursion <= 0.15 m against truth. A leg shorter
/// than 8 s is reported without a bar.
std::vector<Result> hover_results(const std::filesystem::path& log, const std::vector<Phase>& phases);

/// Deadlines, skipped releases, page faults, lost frames. `allowed_miss_share` of all ticks may miss; faults have a bar
/// of zero only when `real_time`.
std::vector<Result> timing_results(const RunSummary& run, double allowed_miss_share);

}  // namespace wasp::tools
