// Where the sister programs and the default configuration lie, seen from the running executable: a build folder or an
// installed prefix.
#pragma once

#include <filesystem>
#include <string>

namespace wasp::tools {

/// Folder of the running executable.
std::filesystem::path program_folder();
/// Path of a sister program, e.g. "wasp-sim".
std::string program(const std::string& name);
/// Folder with wasp.toml. Throws std::runtime_error if neither the source tree nor an installation has it.
std::filesystem::path config_folder();

}  // namespace wasp::tools
