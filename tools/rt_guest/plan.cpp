#include "tools/rt_guest/plan.h"

#include <cmath>

namespace wasp::tools::rt_guest {
namespace {

constexpr int kFault_s = 15;     // a flight and its landing, about
constexpr int kWatchdog_s = 40;  // two flights
/// Deaths, a hanging thread, what stops coming, the wall clock, no budget: what a promise in milliseconds is made of.
constexpr const char* kFaults =
    "^(flight-(killed|segv)|control-thread-stops|attitude-stop|line-silence|wall-clock-year-ahead|"
    "start-budget-of-the-kernel)$";
constexpr int kFaultCount = 7;
/// All but what needs a camera, a second core, or programs that are not in the guest.
constexpr const char* kAllFaults =
    "^(attitude|imu|wire|sensor|line|autopilot|stranger|behaviour|control|link|flight|guardian|monitor|policy|priority|"
    "wall|config|timeline|start-budget-of)-";
constexpr int kAllFaultCount = 90;

}  // namespace

int Job::seconds() const {
  if (kind == JobKind::kFaults) return kFault_s * fault_count;
  if (kind == JobKind::kWatchdog) return kWatchdog_s;
  return static_cast<int>(std::ceil(static_cast<double>(cycles) / kControlRate_hz));
}

std::string Job::line() const {
  if (kind == JobKind::kRights) return "rights " + name;
  if (kind == JobKind::kFaults) return "faults " + name + " " + faults + (timed ? "" : " --untimed");
  if (kind == JobKind::kWatchdog) return "watchdog " + name + " " + module;
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
  if (arch == "amd64") plan.jobs.push_back({.name = "watchdog", .kind = JobKind::kWatchdog, .module = "i6300esb"});
  if (arch != "arm64") return plan;
  plan.jobs.push_back({.name = "stressed", .cycles = cycles.stressed, .stressed = true});
  plan.jobs.push_back({.name = "not-real-time", .cycles = cycles.not_real_time, .real_time = false, .stressed = true});
  return plan;
}

Plan plan_faults(const std::string& arch, const std::string& only) {
  Plan plan{.arch = arch, .jobs = {}, .bars = {}};
  plan.jobs.push_back({.name = "faults",
                       .kind = JobKind::kFaults,
                       .faults = only.empty() ? kAllFaults : only,
                       .fault_count = only.empty() ? kAllFaultCount : 1});
  return plan;
}

Plan plan_two_cores(const std::string& arch) {
  Plan plan{.arch = arch, .cores = 2, .jobs = {}, .bars = {}};
  plan.jobs.push_back(
      {.name = "hot-plug", .kind = JobKind::kFaults, .timed = false, .faults = "^core-offlined$", .fault_count = 1});
  return plan;
}

}  // namespace wasp::tools::rt_guest
