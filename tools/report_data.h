// Everything a report is made from, read from the folder of a run. Any part may be missing; what is, is listed.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/csv_table.h"
#include "tools/latency_summary.h"

namespace wasp::tools {

struct ReportData {
  std::filesystem::path directory;
  nlohmann::json run = nlohmann::json::object();     ///< run.json
  nlohmann::json record = nlohmann::json::object();  ///< log/record.json: losses
  std::optional<CsvTable> attitude, cues, commands, truth;
  std::vector<StageSummary> stages;
  RunSummary status;
  std::vector<std::string> remarks;  ///< what is missing or damaged, one sentence each
  std::int64_t origin_ns = 0;        ///< the report's t = 0: the first command, else the first sample

  [[nodiscard]] double seconds(std::int64_t t_ns) const { return static_cast<double>(t_ns - origin_ns) * 1e-9; }
};

/// Throws std::runtime_error only if `directory` is not a folder.
ReportData read_report_data(const std::filesystem::path& directory);

/// A JSON value as text: strings as they are, numbers with four digits, booleans as yes and no, null as "".
std::string text_of(const nlohmann::json& value);
/// run[key] as text; "" if absent.
std::string text_at(const nlohmann::json& object, const char* key);

}  // namespace wasp::tools
