// Admission: may this thread table be flown? The table of a configuration as the response-time analysis sees it, with
// budgets as configured or as an earlier flight measured them, and what to say of the result.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "scheduling/config.h"
#include "scheduling/response_time.h"

namespace wasp::scheduling {

/// Longest measured execution by thread name, from the stages of an earlier flight.
using MeasuredCosts = std::map<std::string, DurationNs>;

/// Reads log/stages.json as wasp-record writes it: the maximum of "compute", for control plus that of "write". Wall
/// time, so that delays by other threads are in it: an upper bound. Throws std::runtime_error naming the file.
MeasuredCosts read_measured_costs(const std::string& path);

struct PlanRow {
  AnalysedThread thread;
  ResponseTime response;
  bool measured = false;  ///< the cost is a measured maximum, not the configured budget
};

struct Plan {
  std::vector<PlanRow> rows;  ///< highest priority first
  std::vector<int> cores;     ///< those the table uses, rising
  bool schedulable = true;
  std::vector<std::string> reasons;  ///< why not, one line a thread
};

/// Enabled behaviours only. `frame_period_ns` is the front camera's; `with_camera` adds a camera thread: replay,
/// relay, or that of `wasp camera`.
/// Cores are those this process may really use.
Plan make_plan(const Config& config, DurationNs frame_period_ns, bool with_camera, const MeasuredCosts& measured);

/// Table, reasons and a picture of each core from the instant when all its threads are released together.
std::string plan_text(const Plan& plan);
/// The same as one JSON object on one line.
std::string plan_json(const Plan& plan);

}  // namespace wasp::scheduling
