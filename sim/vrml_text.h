// The text of a VRML97 file, looked through before Coin parses it: Coin recurses as deep as the text nests, allocates
// what a picture's head asks for, reads other files, and knows nodes beside VRML97's own.
#pragma once

#include <filesystem>
#include <string>

namespace wasp::sim {

inline constexpr std::size_t kLongestVrml = std::size_t{256} << 20;  ///< bytes
inline constexpr int kDeepestVrml = 200;                             ///< brackets open at once

/// Throws std::runtime_error naming the file and line: not VRML97 in plain text, too long or too deep, a node that is
/// none of VRML97's and no PROTO before it, a node that would read another file or run a script, a picture without its
/// pixels.
std::string read_vrml_text(const std::filesystem::path& file);

}  // namespace wasp::sim
