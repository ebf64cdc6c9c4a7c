#include "tools/mission_files.h"

#include <algorithm>
#include <stdexcept>

#include "tools/program_paths.h"

namespace wasp::tools {

namespace fs = std::filesystem;

std::vector<std::string> mission_names() {
  std::vector<std::string> names;
  const fs::path folder = config_folder() / "missions";
  if (fs::is_directory(folder))
    for (const auto& entry : fs::directory_iterator(folder))
      if (fs::exists(entry.path() / "sim.toml") && fs::exists(entry.path() / "flight.toml"))
        names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::string mission_list() {
  std::string list;
  for (const auto& name : mission_names()) list += (list.empty() ? "" : ", ") + name;
  return list;
}

fs::path mission_folder(const std::string& name) {
  const auto names = mission_names();
  if (std::find(names.begin(), names.end(), name) != names.end()) return config_folder() / "missions" / name;
  throw std::runtime_error("unknown mission '" + name + "'; known: " + mission_list());
}

}  // namespace wasp::tools
