// VRML97 through Coin, in this process. Coin takes hostile files at their word and may crash on one: users go through
// sim/vrml_reader.h, which does this in a process of its own.
#pragma once

#include <filesystem>

#include "sim/scene.h"

namespace wasp::sim {

/// As read_vrml (sim/vrml_file.h); one call at a time. Throws std::runtime_error naming the file.
Scene read_vrml_with_coin(const std::filesystem::path& file);

}  // namespace wasp::sim
