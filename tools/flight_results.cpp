#include "tools/flight_results.h"

#include <algorithm>
#include <cmath>

#include "control/mission.h"
#include "tools/csv_table.h"

namespace wasp::tools {
namespace {

constexpr std::int64_t kSettle_ns = 5 * kSecond;
constexpr double kLeastJudged_s = 3.0;

std::string leg_name(int leg, double setpoint_m) {
  std::string height = nlohmann::json(std::round(setpoint_m * 100) / 100).dump();
  return "hover " + std::to_string(leg + 1) + " at " + height + " m";
}

}  // namespace

std::vector<Phase> read_phases(const std::filesystem::path& log) {
  std::vector<Phase> phases;
  const auto table = CsvTable::read(log / "commands.csv");
  if (!table) return phases;
  const auto phase = table->integers("mission_phase"), due = table->integers("due_at_ns");
  const auto setpoint = table->numbers("height_setpoint_m");
  for (std::size_t i = 0; i < phase.size(); ++i) {
    const bool fresh = i == 0 || phase[i] != phase[i - 1];
    const auto mission_phase = static_cast<control::MissionPhase>(phase[i]);
    if (fresh) phases.push_back({control::name_of(mission_phase), 0, due[i], due[i]});
    phases.back().end_ns = due[i];
    phases.back().setpoint_m = setpoint[i];
    if (const int leg = control::leg_of(mission_phase); leg >= 0) phases.back().name = leg_name(leg, setpoint[i]);
  }
  return phases;
}

std::vector<Result> hover_results(const std::filesystem::path& log, const std::vector<Phase>& phases) {
  std::vector<Result> results;
  const auto truth = CsvTable::read(log / "truth.csv");
  if (!truth) return {{"simulator's truth logged", 0.0, "", "== 1", false}};
  const auto at = truth->integers("exposed_at_ns");
  const auto height = truth->numbers("height_m");
  for (const Phase& p : phases) {
    if (!p.name.starts_with("hover")) continue;
    double square_sum = 0, excursion_m = 0, mean = 0;
    std::size_t n = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (at[i] < p.start_ns + kSettle_ns || at[i] > p.end_ns) continue;
      const double error_m = height[i] - p.setpoint_m;
      square_sum += error_m * error_m;
      mean += error_m;
      excursion_m = std::max(excursion_m, std::fabs(error_m));
      ++n;
    }
    if (n == 0) {
      results.push_back({p.name + ": too short to judge", 0.0, "", "", true});
      continue;
    }
    const double rms_m = std::sqrt(square_sum / static_cast<double>(n));
    const bool judged = to_seconds(p.end_ns - p.start_ns - kSettle_ns) >= kLeastJudged_s;
    Result rms = at_most(p.name + ": RMS height error", rms_m, "m", 0.03);
    Result worst = at_most(p.name + ": greatest excursion", excursion_m, "m", 0.15);
    if (!judged) {
      rms = {rms.name, rms_m, "m", "", true};
      worst = {worst.name, excursion_m, "m", "", true};
    }
    results.push_back(rms);
    results.push_back(worst);
    results.push_back({p.name + ": mean error", mean / static_cast<double>(n), "m", "", true});
  }
  return results;
}

std::vector<Result> timing_results(const RunSummary& run, double allowed_miss_share) {
  const auto releases = static_cast<double>(run.ticks + run.skipped);
  const double misses = static_cast<double>(run.deadline_misses + run.skipped);
  std::vector<Result> results;
  results.push_back({"control releases", releases, "", "> 0", releases > 0});
  Result missed = at_most("control deadlines missed or skipped", misses, "", std::floor(allowed_miss_share * releases));
  results.push_back(missed);
  results.push_back({"skipped control releases", static_cast<double>(run.skipped), "", "", true});
  const bool faults_matter = run.real_time;
  const auto faults = [&](const char* name, std::uint64_t n) {
    return faults_matter ? at_most(name, static_cast<double>(n), "", 0)
                         : Result{name, static_cast<double>(n), "", "", true};
  };
  results.push_back(faults("minor page faults in real-time threads", run.minor_faults));
  results.push_back(faults("major page faults in real-time threads", run.major_faults));
  results.push_back({"frames lost to a lapping writer", static_cast<double>(run.frames_lost), "", "", true});
  results.push_back({"incident files written", static_cast<double>(run.incidents), "", "", true});
  results.push_back({"commands refused as too old", static_cast<double>(run.commands_refused), "", "", true});
  results.push_back({"link frames with a bad checksum", static_cast<double>(run.bad_frames), "", "", true});
  return results;
}

}  // namespace wasp::tools
