// From exposure to the serial byte: which cue a tick considered, and where the time of the first command that could use
// it went. The parts of a chain add up to its length to the nanosecond.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "benchmarks/latency_data.h"
#include "tools/quantiles.h"

namespace wasp::bench {

/// Parts of a chain, in order.
inline constexpr std::array<const char*, 7> kChainParts = {"camera (exposure to frame)",
                                                           "wake-up",
                                                           "compute",
                                                           "wait for the tick",
                                                           "control wake-up",
                                                           "control compute",
                                                           "write"};

struct Chain {
  TimeNs exposed_at_ns = 0;
  DurationNs total_ns = 0;  ///< exposure to the command's last byte
  std::array<DurationNs, kChainParts.size()> part_ns{};
};

struct StageFigures {
  std::string owner, stage;
  tools::Quantiles q;
};

/// One behaviour's chains and its age at each use.
struct BehaviourChains {
  std::string name;
  std::vector<Chain> chains;                 ///< one a cue that reached a command
  std::vector<std::int64_t> age_ns;          ///< exposure to the tick that considered it, every tick
  [[nodiscard]] const Chain* worst() const;  ///< nullptr if there is none
};

/// `ticks` and `cues` rising in time. A tick considers the newest cue published before it ran.
BehaviourChains follow_cues(const std::string& name, const std::vector<Tick>& ticks, const std::vector<SeenCue>& cues);

/// Every stage of every behaviour and of control, whole population.
std::vector<StageFigures> stage_figures(const std::vector<Tick>& ticks, const std::vector<BehaviourChains>& behaviours,
                                        const std::vector<std::vector<SeenCue>>& cues);

}  // namespace wasp::bench
