// A mission is a folder config/missions/NAME: sim.toml, the world and vehicle it is flown in, and flight.toml, what the
// flight process is told over the defaults. Cameras are said once, in sim.toml.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scheduling/config.h"
#include "sim/lockstep.h"
#include "tools/mission_files.h"

namespace wasp::missions {

using tools::mission_folder, tools::mission_names;

struct MissionSetup {
  std::string name;
  sim::SimConfig sim;
  scheduling::Config flight;

  /// Sum of the legs and what take-off and landing may need [s].
  [[nodiscard]] double limit_s() const;
};

/// Loads both files; `extra` are further flight configurations, read last. Throws std::runtime_error naming file and
/// key.
MissionSetup load_mission(const std::string& name, std::uint32_t seed, const std::vector<std::string>& extra = {});

/// The flight of a mission in lockstep: its enabled behaviours, as all_behaviours() lists them.
sim::LockstepOptions lockstep_options(const MissionSetup& setup);

}  // namespace wasp::missions
