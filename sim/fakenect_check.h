// What is wrong with a dump for fakenect, which itself ends the program at a file that is missing or has no header, and
// copies beyond the end of one that is too short.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace wasp::sim {

struct FakenectReport {
  std::size_t entries = 0;
  std::vector<std::string> good;      ///< names, in order
  std::vector<std::string> problems;  ///< "INDEX.txt:LINE: NAME: what is wrong"
};

/// Looks at every entry: name, kind, size, header, order of arrival. Throws std::runtime_error without an INDEX.txt.
FakenectReport check_fakenect(const std::filesystem::path& folder);

/// Writes an INDEX.txt of the good entries; the old one stays as INDEX.txt.before. Throws std::runtime_error.
void write_fakenect_index(const std::filesystem::path& folder, const FakenectReport& report);

}  // namespace wasp::sim
