#include "tools/program_paths.h"

#include <stdexcept>

namespace wasp::tools {

namespace fs = std::filesystem;

fs::path program_folder() { return fs::read_symlink("/proc/self/exe").parent_path(); }

std::string program(const std::string& name) { return (program_folder() / name).string(); }

fs::path config_folder() {
  const fs::path here = program_folder();  // of a test: one folder deeper
  for (const fs::path& candidate : {here / "../config", here / "../share/wasp/config", here / "../../config"})
    if (fs::exists(candidate / "wasp.toml")) return fs::weakly_canonical(candidate);
  throw std::runtime_error("default configuration wasp.toml not found beside " + here.string());
}

}  // namespace wasp::tools
