#include "faults/negative.h"

#include <fmt/format.h>

#include <array>
#include <iostream>

namespace wasp::faults {
namespace {

/// A fault, where, and what takes the flight's answer away.
struct Control {
  std::string_view fault;
  Phase phase;
  bool guarded;
  std::string_view weakened;
};

constexpr std::array kControls = {
    Control{"^wire-attitude-lost$", Phase::kCruise, true, "[control]\nattitude_age_limit_ms = 5000\n"},
    Control{"^line-silence$", Phase::kCruise, true,
            "[control]\nattitude_age_limit_ms = 5000\nlink_age_limit_ms = 5000\n"},
    Control{"^camera-process-stop$", Phase::kCruise, true,
            "[behaviour.ground_altitude]\nage_limit_ms = 5000\n[behaviour.odometry]\nage_limit_ms = 5000\n"},
    Control{"^camera-freeze$", Phase::kCruise, true, "[camera]\nstuck_frames = 0\n"},
    Control{"^flight-killed$", Phase::kHover, false, ""},
    Control{"^control-thread-stops$", Phase::kHover, false, ""},
};

}  // namespace

int run_negative(const CampaignOptions& options, const Abilities& abilities, const CampaignHooks& hooks) {
  bool all_missed = true;
  for (const Control& control : kControls) {
    if (hooks.interrupted()) return 4;
    CampaignOptions o = options;
    o.only = control.fault, o.phase = control.phase;
    o.weakened = control.weakened, o.guarded = control.guarded;
    o.times = false;  // what is late is no proof: it must not come at all
    for (const CellResult& r : run_campaign(o, abilities, hooks)) {
      if (r.verdict == Verdict::kSkipped) continue;  // said in its row
      const bool missed = r.verdict == Verdict::kMiss;
      all_missed = all_missed && missed;
      std::cout << fmt::format("  negative control {}: {}\n", r.cell.fault->id,
                               missed ? "the bar fails, as it must" : "NOT SEEN: the bar cannot fail");
    }
  }
  return all_missed ? 0 : 1;
}

}  // namespace wasp::faults
