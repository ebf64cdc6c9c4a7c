// One flight of the campaign: what is flown, with what, and the files that say so.
#pragma once

#include <array>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "faults/fault.h"
#include "faults/wire_checker.h"

namespace wasp::faults {

/// What the programs at hand can do; asked once.
struct Abilities {
  bool real_time = false;     ///< the flight has the rights
  bool fault_points = false;  ///< `wasp flight --fault-socket`
  bool guardian = false;      ///< `wasp guard`
  bool renderer = false;      ///< `wasp-sim` can be a camera
  bool gateway = false;       ///< `wasp iceoryx`, and its daemon
  bool own_machine = false;   ///< nobody else needs this machine's clock and cores
  bool replay = false;        ///< frames come from a recording: no camera process to do anything to
};
/// Runs the programs beside this one.
Abilities find_abilities();

/// What may watch a flight: it must not matter what becomes of them. The gateway is iceoryx's, with its daemon.
inline constexpr std::array<std::string_view, 4> kObservers = {"recorder", "monitor", "gateway", "daemon"};

struct FlightPlan {
  Phase phase = Phase::kHover;
  std::uint32_t seed = 1;
  Abilities abilities;
  bool guarded = true;                        ///< where it can be
  std::set<std::string_view> observers = {};  ///< of kObservers, that watch it
  std::string weakened;                       ///< TOML after all others: a negative control
  std::vector<std::string> flight_options = {};
  std::filesystem::path replay = {};  ///< a recording instead of the camera; hover only
  std::filesystem::path folder;       ///< of this flight, its own
  std::string instance;
};

/// Writes sim.toml and flight.toml into the folder.
void write_configuration(const FlightPlan& plan);
/// What must hold on the wire of that flight: read from the configuration, without what weakens it.
WireLimits limits_of(const FlightPlan& plan);

std::vector<std::string> sim_arguments(const FlightPlan& plan);
std::vector<std::string> camera_arguments(const FlightPlan& plan);
std::vector<std::string> observer_arguments(const FlightPlan& plan, std::string_view observer);
std::vector<std::string> flight_arguments(const FlightPlan& plan);
/// Paths of the folder.
std::string autopilot_line(const FlightPlan& plan);
std::string flight_line(const FlightPlan& plan);
std::string fault_socket(const FlightPlan& plan);

}  // namespace wasp::faults
