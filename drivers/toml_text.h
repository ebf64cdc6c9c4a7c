// TOML text from anybody: what toml11 3.7 cannot take (it reads wild at an invalid UTF-8 sequence in a string, and
// recurses as deep as the text nests) is refused before it sees it. Every TOML file of the house comes in here.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <toml.hpp>

namespace wasp::drivers {

inline constexpr std::size_t kLongestToml = 1 << 20;  ///< bytes
inline constexpr int kDeepestToml = 256;  ///< brackets open at once, strings and comments included; dots of one key

/// Throws std::runtime_error naming `name`, and the line. Realtime-safe: no.
toml::value parse_toml(std::istream& text, const std::string& name);
/// The same of a file.
toml::value parse_toml_file(const std::filesystem::path& file);

}  // namespace wasp::drivers
