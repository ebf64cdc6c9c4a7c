// Decoded frames for others to compare with: JSON lines, or one CSV a log and message. Floats are exact.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/mavlink_description.h"
#include "tools/mavlink_log.h"
#include "tools/mavlink_scan.h"

namespace wasp::tools {

/// One frame: its head, and its fields by name.
nlohmann::ordered_json frame_json(const MavlinkDescription& description, const MavlinkLog& log, const FoundFrame& frame,
                                  std::size_t index);
/// To standard output, one frame a line, in stream order.
void print_fields(const std::string& file, const MavlinkDescription& description, const MavlinkLog& log,
                  const LogScan& scan);
/// FOLDER/STEM.message_name.csv for each message in the log. Throws std::runtime_error with the path.
void write_fields(const std::filesystem::path& folder, const std::string& stem, const MavlinkDescription& description,
                  const MavlinkLog& log, const LogScan& scan);

}  // namespace wasp::tools
