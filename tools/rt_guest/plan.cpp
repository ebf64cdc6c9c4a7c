#include "tools/rt_guest/plan.h"

#include <cmath>

namespace wasp::tools::rt_guest {

int Job::seconds() const { return static_cast<int>(std::ceil(static_cast<double>(cycles) / kControlRate_hz)); }

std::string Job::line() const {
  if (kind == JobKind::kRights) return "rights " + name;
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
  if (arch != "arm64") return plan;
  plan.jobs.push_back({.name = "stressed", .cycles = cycles.stressed, .stressed = true});
  plan.jobs.push_back({.name = "not-real-time", .cycles = cycles.not_real_time, .real_time = false, .stressed = true});
  return plan;
}

}  // namespace wasp::tools::rt_guest
