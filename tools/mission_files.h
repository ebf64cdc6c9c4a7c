// The missions as they lie on disk: config/missions/NAME with sim.toml, the world and the vehicle it is flown in, and
// flight.toml, what the flight process is told over the defaults.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace wasp::tools {

/// Names of the missions, sorted: folders that hold both files.
std::vector<std::string> mission_names();

/// "aggressive, all, ...".
std::string mission_list();

/// Folder of a mission. Throws std::runtime_error "unknown mission 'x'; known: ...".
std::filesystem::path mission_folder(const std::string& name);

}  // namespace wasp::tools
