// Many flights of one mission in lockstep on virtual time, on a few threads, each with its own seed. Any of them can be
// flown again, the same to the bit, by its seed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "missions/judge.h"

namespace wasp::missions {

struct CampaignOptions {
  std::string mission;
  int runs = 100;
  std::uint32_t first_seed = 1;
  int jobs = 2;
  std::vector<std::string> configs;  ///< further flight configurations, read last
};

struct CampaignRun {
  std::uint32_t seed = 0;
  Measures measures;
  double flight_s = 0;  ///< virtual
  double wall_s = 0;    ///< of one thread
  std::string error;    ///< why it could not be flown; empty: it was
};

struct CampaignProgress {
  int done = 0, runs = 0;
  double elapsed_s = 0, left_s = 0;  ///< left: an estimate
  double flown_s = 0;                ///< virtual time of the flights done
};

struct CampaignResult {
  CampaignOptions options;
  std::vector<CampaignRun> runs;  ///< by seed
  double wall_s = 0;
  std::vector<tools::Result> results;
  [[nodiscard]] double flown_s() const;
  /// Virtual time by wall time over all threads.
  [[nodiscard]] double speed_up() const { return wall_s > 0 ? flown_s() / wall_s : 0; }
  [[nodiscard]] bool passed() const;
};

/// What is done with a flight before it is judged.
using FlightLook = std::function<void(const FlightTrace&, const WorldProbe&)>;
using FlightKeep = std::function<void(std::uint32_t seed, const FlightTrace&, const WorldProbe&)>;

/// One flight. The trace is handed to `look`, if given, before it is judged.
CampaignRun fly_once(const MissionSetup& setup, const FlightLook& look = {});

/// Flies all runs. `on_progress` is called after each, from one thread at a time; `keep` (optional) is given every
/// trace likewise. A run that cannot be flown is noted and fails the campaign. Throws what load_mission throws.
CampaignResult fly_campaign(const CampaignOptions& options,
                            const std::function<void(const CampaignProgress&)>& on_progress,
                            const FlightKeep& keep = {});

/// One line a run: seed, seconds, every figure. Written beside itself first, then renamed. Throws naming the file.
void write_csv(const CampaignResult& result, const std::filesystem::path& file);

/// "12 of 100 flights, 41 s, 5 min left, 11.3 x real time"
std::string progress_text(const CampaignProgress& progress);

}  // namespace wasp::missions
