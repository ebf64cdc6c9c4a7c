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
  return {.arch = arch,
          .jobs = {{.name = "rights", .kind = JobKind::kRights},
                   {.name = "quiet", .cycles = cycles.quiet},
                   {.name = "stressed", .cycles = cycles.stressed, .stressed = true},
                   {.name = "not-real-time", .cycles = cycles.not_real_time, .real_time = false, .stressed = true}},
          .bars = {}};
}

}  // namespace wasp::tools::rt_guest
