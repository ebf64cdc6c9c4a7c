#include "faults/campaign.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <deque>
#include <regex>

#include "faults/catalogue.h"
#include "faults/injector.h"
#include "faults/shared_flight.h"
#include "faults/start_cell.h"
#include "shm/region.h"

namespace wasp::faults {
namespace {

/// Cells that can share one flight.
struct Group {
  Phase phase = Phase::kHover;
  std::uint32_t seed = 1;
  std::deque<Cell> cells;
};

bool wanted(const Fault& fault, const CampaignOptions& o) {
  if (o.class_number && fault.class_number != *o.class_number) return false;
  if (o.short_set && !fault.in_short) return false;
  return o.only.empty() || std::regex_search(fault.id.begin(), fault.id.end(), std::regex(o.only));
}

/// The phases of a fault that are asked for; in the short set only the first.
std::vector<Phase> phases_of(const Fault& fault, const CampaignOptions& o) {
  std::vector<Phase> phases;
  for (const Phase phase : {Phase::kCruise, Phase::kHover, Phase::kIdle, Phase::kTakeOff, Phase::kLanding})
    if ((fault.phases & bit(phase)) != 0 && (!o.phase || *o.phase == phase)) phases.push_back(phase);
  if (o.short_set && phases.size() > 1) phases.resize(1);
  return phases;
}

/// Regions that a campaign left behind that was killed.
void sweep() {
  static const std::regex kOurs(R"(^wasp\.faults-(\d+)-.*)");
  for (const std::string& name : shm::Region::list("wasp.faults-")) {
    std::smatch m;
    if (std::regex_match(name, m, kOurs) && kill(std::stoi(m[1]), 0) != 0) shm::Region::remove(name);
  }
}

class Campaign {
 public:
  Campaign(const CampaignOptions& options, const Abilities& abilities, const CampaignHooks& hooks)
      : options_(options), abilities_(abilities), hooks_(hooks) {}

  std::vector<CellResult> run() {
    sweep();
    std::vector<Group> groups;
    for (const Cell& cell : select_cells(options_)) {
      ++total_;
      if (const std::string why = missing_for(*cell.fault, abilities_); !why.empty()) {
        finish({.cell = cell, .verdict = Verdict::kSkipped, .why = why});
      } else if (cell.fault->injector == Injector::kStart) {
        starts_.push_back(cell);
      } else {
        group(groups, cell);
      }
    }
    for (const Cell& cell : starts_)
      if (!hooks_.interrupted()) finish(start(cell));
    for (Group& g : groups)
      while (!g.cells.empty() && !hooks_.interrupted()) fly(g);
    return std::move(results_);
  }

 private:
  static void group(std::vector<Group>& groups, const Cell& cell) {
    for (Group& g : groups)
      if (g.phase == cell.phase && g.seed == cell.seed) return g.cells.push_back(cell);
    groups.push_back({cell.phase, cell.seed, {cell}});
  }

  std::string next_name() { return fmt::format("faults-{}-{}", getpid(), ++flights_); }

  CellResult start(const Cell& cell) {
    const std::string name = next_name();
    const auto folder = options_.out / name;
    const StartResult r = try_start(*cell.fault, folder, name);
    CellResult result{.cell = cell, .verdict = r.wrong.empty() ? Verdict::kOk : Verdict::kMiss, .why = r.wrong};
    result.outcome = fmt::format("refused, code {}", r.exit_code);
    result.folder = folder;
    return result;
  }

  void fly(Group& g) {
    FlightPlan plan;
    plan.phase = g.phase, plan.seed = g.seed;
    plan.abilities = abilities_;
    plan.guarded = options_.guarded;
    plan.replay = options_.replay;
    plan.weakened = options_.weakened;
    for (const Cell& cell : g.cells)
      if (std::ranges::find(kObservers, cell.fault->target) != kObservers.end())
        plan.observers.insert(cell.fault->target);
    if (plan.observers.contains("daemon")) plan.observers.insert("gateway");
    plan.instance = next_name();
    plan.folder = options_.out / plan.instance;
    const std::size_t before = g.cells.size();
    try {
      SharedFlight flight(options_, plan, hooks_);
      for (const CellResult& result : flight.fly(g.cells, results_.size(), total_)) finish(result);
    } catch (const std::exception& error) {
      if (g.cells.size() < before) throw;  // of our own making
      finish({.cell = g.cells.front(), .verdict = Verdict::kMiss, .why = error.what()});
      g.cells.pop_front();
    }
  }

  void finish(const CellResult& result) {
    results_.push_back(result);
    hooks_.judged(result);
    hooks_.tried(results_.size(), total_);
  }

  const CampaignOptions& options_;
  Abilities abilities_;
  const CampaignHooks& hooks_;
  std::vector<CellResult> results_;
  std::vector<Cell> starts_;
  std::size_t total_ = 0;
  int flights_ = 0;
};

}  // namespace

const char* name_of(Verdict verdict) {
  constexpr std::array kNames = {"ok", "MISS", "host noise", "skipped"};
  return kNames[static_cast<std::size_t>(verdict)];
}

std::vector<Cell> select_cells(const CampaignOptions& o) {
  std::vector<Cell> cells;
  for (int seed = 1; seed <= o.seeds; ++seed)
    for (const Fault& fault : catalogue()) {
      if (!wanted(fault, o)) continue;
      if (fault.injector == Injector::kStart) {
        const bool any_phase = !o.phase || !o.replay.empty();  // a replay is in hover only
        if (seed == 1 && any_phase) cells.push_back({&fault, Phase::kIdle, 1});
        continue;
      }
      for (const Phase phase : phases_of(fault, o)) cells.push_back({&fault, phase, static_cast<std::uint32_t>(seed)});
    }
  return cells;
}

std::vector<CellResult> run_campaign(const CampaignOptions& options, const Abilities& abilities,
                                     const CampaignHooks& hooks) {
  return Campaign(options, abilities, hooks).run();
}

}  // namespace wasp::faults
