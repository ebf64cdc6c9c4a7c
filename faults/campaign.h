// The campaign: which cells (fault, phase, seed), in which flights, and what came of each.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "faults/fault.h"
#include "faults/flight_plan.h"
#include "faults/reaction.h"
#include "faults/wire_checker.h"

namespace wasp::faults {

struct Cell {
  const Fault* fault = nullptr;
  Phase phase = Phase::kHover;
  std::uint32_t seed = 1;
};

enum class Verdict : std::uint8_t { kOk, kMiss, kHostNoise, kSkipped };
const char* name_of(Verdict verdict);

struct CellResult {
  Cell cell;
  Verdict verdict = Verdict::kSkipped;
  std::string why = {};      ///< of a verdict that is not ok
  std::string outcome = {};  ///< what became of the flight
  Reaction reaction = {};
  std::vector<Violation> violations = {};
  std::uint64_t records_lost = 0;
  std::filesystem::path folder = {};
};

struct CampaignOptions {
  std::string only;  ///< regular expression on ids; empty: all
  std::optional<int> class_number;
  std::optional<Phase> phase;
  int seeds = 1;
  bool short_set = false;  ///< the few cells of the short set
  bool times = true;       ///< judge times; else only whether things came, with generous waiting
  bool isolate = false;    ///< one flight each
  std::string weakened;    ///< negative control: TOML read after all others
  bool guarded = true;
  std::filesystem::path replay = {};  ///< frames from this recording, hover only: where nothing can render
  std::filesystem::path out = "out/faults";
};

/// What is to be tried, in the order of the catalogue: by phase, then seed, so that flights can be shared.
std::vector<Cell> select_cells(const CampaignOptions& options);

struct CampaignHooks {
  std::function<bool()> interrupted = [] { return false; };
  std::function<void(std::size_t tried, std::size_t of)> tried = [](auto&&...) {};  ///< not judged yet: progress
  std::function<void(const CellResult&)> judged = [](auto&&...) {};
};

/// Flies them all. Never throws for what a flight does; a cell that could not be flown is a MISS.
std::vector<CellResult> run_campaign(const CampaignOptions& options, const Abilities& abilities,
                                     const CampaignHooks& hooks);

}  // namespace wasp::faults
