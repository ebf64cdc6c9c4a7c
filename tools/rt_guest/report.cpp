#include "tools/rt_guest/report.h"

namespace wasp::tools::rt_guest {
namespace {

nlohmann::json job_json(const Job& job, const JobOutcome& outcome) {
  return {{"name", job.name},           {"real_time", job.real_time},     {"stressed", job.stressed},
          {"cycles_asked", job.cycles}, {"exit_code", outcome.exit_code}, {"figures", outcome.figures},
          {"log", outcome.log}};
}

}  // namespace

nlohmann::json report_json(const Plan& plan, const std::string& kernel_package, const Console& console,
                           const std::vector<Result>& results) {
  nlohmann::json document{{"arch", plan.arch},
                          {"kernel", console.kernel()},
                          {"kernel_package", kernel_package},
                          {"jobs", nlohmann::json::array()},
                          {"results", nlohmann::json::array()}};
  for (const Job& job : plan.jobs) {
    const auto it = console.outcomes().find(job.name);
    document["jobs"].push_back(job_json(job, it == console.outcomes().end() ? JobOutcome{} : it->second));
  }
  for (const Result& r : results) document["results"].push_back(to_json(r));
  return document;
}

}  // namespace wasp::tools::rt_guest
