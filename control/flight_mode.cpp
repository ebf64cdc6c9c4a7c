#include "control/flight_mode.h"

#include <array>

namespace wasp::control {
namespace {

struct Row {
  bool (*applies)(const Situation&) WASP_REALTIME;
  FlightMode mode;
  ModeReason reason;
};

constexpr std::array kRows = {
    Row{[](const Situation& s) WASP_REALTIME { return !s.autopilot_armed; }, FlightMode::kDisarmed,
        ModeReason::kMissionStep},
    Row{[](const Situation& s) WASP_REALTIME { return s.only_watching; }, FlightMode::kManual, ModeReason::kRestarted},
    Row{[](const Situation& s) WASP_REALTIME { return s.taken_away; }, FlightMode::kManual, ModeReason::kAutopilotLeft},
    Row{[](const Situation& s) WASP_REALTIME { return !s.link_alive; }, FlightMode::kFailsafe, ModeReason::kLinkLost},
    Row{[](const Situation& s) WASP_REALTIME { return !s.autopilot_follows; }, FlightMode::kManual,
        ModeReason::kAutopilotLeft},
    Row{[](const Situation& s) WASP_REALTIME { return !s.attitude_fresh; }, FlightMode::kFailsafe,
        ModeReason::kAttitudeLost},
    Row{[](const Situation& s) WASP_REALTIME { return !s.setpoint_finite; }, FlightMode::kFailsafe,
        ModeReason::kNotFinite},
    Row{[](const Situation& s) WASP_REALTIME { return s.ground_lost_long; }, FlightMode::kFailsafe,
        ModeReason::kCueLost},
    Row{[](const Situation& s) WASP_REALTIME { return s.deadlines_missed; }, FlightMode::kHold,
        ModeReason::kDeadlineMissed},
    Row{[](const Situation& s) WASP_REALTIME { return !s.images_fresh; }, FlightMode::kHold, ModeReason::kCueLost},
    Row{[](const Situation& s) WASP_REALTIME { return !s.ground_seen; }, FlightMode::kHold, ModeReason::kCueLost},
    Row{[](const Situation&) WASP_REALTIME { return true; }, FlightMode::kBehaviour, ModeReason::kMissionStep},
};

}  // namespace

bool flight_mode_step(const Situation& situation, ModeState& state) noexcept {
  for (const Row& row : kRows) {
    if (!row.applies(situation)) continue;
    const bool moved = row.mode != state.mode;
    state = {row.mode, row.reason};
    return moved;
  }
  return false;
}

const char* name_of(FlightMode mode) noexcept {
  constexpr std::array kNames = {"disarmed", "hold", "behaviour", "manual", "failsafe"};
  const auto i = static_cast<std::size_t>(mode);
  return i < kNames.size() ? kNames[i] : "unknown";
}

const char* name_of(ModeReason reason) noexcept {
  constexpr std::array kNames = {"none",
                                 "start",
                                 "mission step",
                                 "nothing usable seen",
                                 "seen again",
                                 "attitude lost",
                                 "attitude back",
                                 "link lost",
                                 "link back",
                                 "pilot",
                                 "setpoint not finite",
                                 "autopilot left our mode",
                                 "deadlines missed",
                                 "stop requested",
                                 "landed",
                                 "too old at the wire",
                                 "started again: watching only"};
  const auto i = static_cast<std::size_t>(reason);
  return i < kNames.size() ? kNames[i] : "unknown";
}

}  // namespace wasp::control
