#include "tools/flight_config.h"

#include <algorithm>

#include "drivers/toml_text.h"
#include "tools/program_paths.h"

namespace wasp::tools {
namespace {

std::vector<std::string> behaviour_names(const std::vector<std::string>& files) {
  std::vector<std::string> names;
  for (const auto& file : files) {
    const toml::value root = drivers::parse_toml_file(file);
    if (!root.contains("behaviour")) continue;
    for (const auto& [name, section] : toml::find(root, "behaviour").as_table())
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

}  // namespace

scheduling::Config read_flight_config(const std::vector<std::string>& extra) {
  std::vector<std::string> files{(config_folder() / "wasp.toml").string()};
  files.insert(files.end(), extra.begin(), extra.end());
  return scheduling::load_config(files, behaviour_names(files));
}

scheduling::Config read_flight_config(const std::string& extra) {
  return read_flight_config(extra.empty() ? std::vector<std::string>{} : std::vector{extra});
}

}  // namespace wasp::tools
