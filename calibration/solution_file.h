// A solution on disk: the TOML that `wasp flight --config` takes, and the pictures beside it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/calibration.h"

namespace wasp::calibration {

/// Comments with notes, the flight's sections, then [calibration.NAME] with the evidence. `date` is ISO 8601, UTC.
std::string solution_toml(const Solution& solution, std::string_view name, const std::string& date);

/// Writes `out` and its pictures (OUT without .toml, _NAME.svg); returns every file written. A file is never left half
/// written: it is made beside and renamed. Throws std::runtime_error naming the file.
std::vector<std::filesystem::path> write_solution(const Solution& solution, std::string_view name,
                                                  const std::filesystem::path& out);

}  // namespace wasp::calibration
