#include "tools/rt_guest/plan.h"

#include <cmath>

namespace wasp::tools::rt_guest {
namespace {

constexpr int kFault_s = 15;  // a flight and its landing, about
/// Deaths, a hanging thread, what stops coming, and the wall clock: what a promise in milliseconds is made of.
constexpr const char* kFaults =
    "^(flight-killed|flight-segv|control-thread-stops|attitude-stop|line-silence|wall-clock-year-ahead)$";
constexpr int kFaultCount = 6;

}  // namespace

int Job::seconds() const {
  if (kind == JobKind::kFaults) return kFault_s * fault_count;
  return static_cast<int>(std::ceil(static_cast<double>(cycles) / kControlRate_hz));
}

std::string Job::line() const {
  if (kind == JobKind::kRights) return "rights " + name;
  if (kind == JobKind::kFaults) return "faults " + name + " " + faults;
  return "flight " + name + " " + std::to_string(seconds()) + (real_time ? " rt" : " other") +
         (stressed ? " stress" : " idle");
}

int Plan::seconds() const {
  int sum = 0;
  for (const Job& job : jobs) sum += job.seconds();
  return sum;
}

Plan plan_boot(const std::string& arch, const Cycles& cycles) {
  Plan plan{.arch = arch, .jobs = {}, .bars = {}};
  plan.jobs.push_back({.name = "rights", .kind = JobKind::kRights});
  plan.jobs.push_back({.name = "quiet", .cycles = cycles.quiet});
  plan.jobs.push_back({.name = "faults", .kind = JobKind::kFaults, .faults = kFaults, .fault_count = kFaultCount});
  if (arch != "arm64") return plan;
  plan.jobs.push_back({.name = "stressed", .cycles = cycles.stressed, .stressed = true});
  plan.jobs.push_back({.name = "not-real-time", .cycles = cycles.not_real_time, .real_time = false, .stressed = true});
  return plan;
}

}  // namespace wasp::tools::rt_guest
