#include "missions/campaign.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "behaviours.h"
#include "rt/clock.h"

namespace wasp::missions {
namespace {

namespace fs = std::filesystem;

/// A field of a CSV in quotes.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

std::string duration_text(double s) {
  return s < 90     ? fmt::format("{:.0f} s", s)
         : s < 5400 ? fmt::format("{:.0f} min", s / 60)
                    : fmt::format("{:.1f} h", s / 3600);
}

/// FFTW's planner, which behaviours call when they are made and unmade, is not for two threads at once.
std::mutex planner;

sim::LockstepLog fly_alone(const MissionSetup& setup) {
  sim::LockstepOptions options;
  std::optional<sim::Lockstep> flight;
  const auto unmake = [&] {
    const std::lock_guard lock(planner);
    flight.reset();
    options = {};
  };
  try {
    {
      const std::lock_guard lock(planner);
      options = lockstep_options(setup);
    }
    flight.emplace(options);
    sim::LockstepLog log = flight->fly(setup.limit_s());
    unmake();
    return log;
  } catch (...) {
    unmake();
    throw;
  }
}

}  // namespace

double CampaignResult::flown_s() const {
  double sum = 0;
  for (const CampaignRun& r : runs) sum += r.flight_s;
  return sum;
}

bool CampaignResult::passed() const {
  return std::all_of(results.begin(), results.end(), [](const auto& r) { return r.ok; }) &&
         std::all_of(runs.begin(), runs.end(), [](const auto& r) { return r.error.empty(); });
}

CampaignRun fly_once(const MissionSetup& setup, const FlightLook& look) {
  CampaignRun run;
  run.seed = setup.sim.seed;
  const TimeNs began_ns = rt::now();
  const FlightTrace trace = trace_of(fly_alone(setup), scheduling::names_of(all_behaviours()));
  run.flight_s = to_seconds(trace.truth.back().exposed_at_ns);
  WorldProbe probe(setup);
  if (look) look(trace, probe);
  run.measures = judge_of(setup.name).measure(trace, setup, probe);
  run.wall_s = to_seconds(rt::now() - began_ns);
  return run;
}

CampaignResult fly_campaign(const CampaignOptions& options,
                            const std::function<void(const CampaignProgress&)>& on_progress, const FlightKeep& keep) {
  (void)load_mission(options.mission, options.first_seed, options.configs);  // errors before any thread
  CampaignResult result{options, std::vector<CampaignRun>(static_cast<std::size_t>(options.runs)), 0, {}};
  const TimeNs began_ns = rt::now();
  std::atomic<int> next{0};
  std::mutex mutex;
  CampaignProgress progress{0, options.runs, 0, 0, 0};
  const auto work = [&] {
    for (int i = next++; i < options.runs; i = next++) {
      const std::uint32_t seed = options.first_seed + static_cast<std::uint32_t>(i);
      CampaignRun& run = result.runs[static_cast<std::size_t>(i)];
      try {
        run = fly_once(load_mission(options.mission, seed, options.configs),
                       [&](const FlightTrace& trace, const WorldProbe& probe) {
                         if (!keep) return;
                         const std::lock_guard lock(mutex);
                         keep(seed, trace, probe);
                       });
      } catch (const std::exception& e) {
        run.seed = seed;
        run.error = e.what();
      }
      const std::lock_guard lock(mutex);
      ++progress.done;
      progress.flown_s += run.flight_s;
      progress.elapsed_s = to_seconds(rt::now() - began_ns);
      progress.left_s = progress.elapsed_s / progress.done * (progress.runs - progress.done);
      if (on_progress) on_progress(progress);
    }
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < std::min(options.jobs, options.runs); ++i) threads.emplace_back(work);
  work();
  for (auto& t : threads) t.join();
  result.wall_s = to_seconds(rt::now() - began_ns);
  std::vector<Measures> measures;
  for (const CampaignRun& r : result.runs) measures.push_back(r.measures);
  result.results = verdict(judge_of(options.mission), measures);
  return result;
}

void write_csv(const CampaignResult& result, const fs::path& file) {
  const fs::path unfinished = file.string() + ".part";
  std::ofstream out(unfinished);
  out << "seed,flight_s,wall_s";
  const Measures* columns = nullptr;
  for (const CampaignRun& r : result.runs)
    if (r.error.empty() && columns == nullptr) columns = &r.measures;
  if (columns != nullptr)
    for (const auto& [name, value] : *columns) out << ',' << quoted(name);
  out << ",error\n";
  for (const CampaignRun& r : result.runs) {
    out << fmt::format("{},{:.3f},{:.3f}", r.seed, r.flight_s, r.wall_s);
    if (columns != nullptr)
      for (const auto& [name, value] : *columns) out << fmt::format(",{:.6g}", value_of(r.measures, name));
    out << ',' << quoted(r.error) << '\n';
  }
  out.close();
  if (!out) {
    fs::remove(unfinished);
    throw std::runtime_error("cannot write " + file.string());
  }
  fs::rename(unfinished, file);
}

std::string progress_text(const CampaignProgress& p) {
  return fmt::format("{} of {} flights, {}, {} left, {:.1f} x real time", p.done, p.runs, duration_text(p.elapsed_s),
                     duration_text(p.left_s), p.elapsed_s > 0 ? p.flown_s / p.elapsed_s : 0);
}

}  // namespace wasp::missions
