#include "tools/report_data.h"

#include <fmt/format.h>

#include <fstream>
#include <stdexcept>

namespace wasp::tools {
namespace {

nlohmann::json read_json(ReportData& data, const char* name) {
  std::ifstream in(data.directory / name);
  if (!in) {
    data.remarks.push_back(fmt::format("{} is missing.", name));
    return nlohmann::json::object();
  }
  auto document = nlohmann::json::parse(in, nullptr, false);
  if (document.is_object()) return document;
  data.remarks.push_back(fmt::format("{} cannot be read: it is not a whole JSON object.", name));
  return nlohmann::json::object();
}

std::optional<CsvTable> read_table(ReportData& data, const char* name) {
  auto table = CsvTable::read(data.directory / name);
  if (!table)
    data.remarks.push_back(fmt::format("{} is missing.", name));
  else if (table->rows() == 0)
    data.remarks.push_back(fmt::format("{} holds no rows.", name));
  if (table && table->bad_lines() > 0)
    data.remarks.push_back(fmt::format("{}: {} lines could not be read.", name, table->bad_lines()));
  if (table && table->cut()) data.remarks.push_back(fmt::format("{} ends in the middle of a line.", name));
  return table;
}

std::int64_t first(const std::optional<CsvTable>& table, const char* column) {
  if (!table || table->rows() == 0) return 0;
  return table->integers(column).front();
}

void remark_losses(ReportData& data) {
  if (!data.record.contains("topics") || !data.record["topics"].is_array()) return;
  for (const auto& t : data.record["topics"]) {
    const auto number = [&t](const char* key) {
      return t.contains(key) && t[key].is_number() ? t[key].get<double>() : 0.0;
    };
    const double lost = number("lost") + number("rejected") + number("refused_by_disk");
    if (lost > 0 && !(t.contains("kept") && t["kept"] == false))
      data.remarks.push_back(fmt::format("The recorder lost {:.0f} of {:.0f} messages of topic {}.", lost,
                                         lost + number("recorded"), text_at(t, "topic")));
  }
}

}  // namespace

ReportData read_report_data(const std::filesystem::path& directory) {
  if (!std::filesystem::is_directory(directory))
    throw std::runtime_error("'" + directory.string() + "' is not a folder");
  ReportData data;
  data.directory = directory;
  data.run = read_json(data, "run.json");
  data.commands = read_table(data, "log/commands.csv");
  data.cues = read_table(data, "log/cues.csv");
  data.attitude = read_table(data, "log/attitude.csv");
  data.truth = read_table(data, "log/truth.csv");
  data.record = read_json(data, "log/record.json");
  const auto stages = read_json(data, "log/stages.json");
  try {
    data.stages = stages_from_json(stages);
    data.status = run_from_json(stages);
  } catch (const nlohmann::json::exception& error) {
    data.remarks.push_back(std::string("log/stages.json has an unexpected form: ") + error.what());
  }
  for (const auto t : {first(data.commands, "due_at_ns"), first(data.truth, "exposed_at_ns"),
                       first(data.attitude, "exposed_at_ns"), first(data.cues, "exposed_at_ns")})
    if (data.origin_ns == 0) data.origin_ns = t;
  remark_losses(data);
  return data;
}

std::string text_of(const nlohmann::json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_integer()) return value.dump();
  if (value.is_number()) return fmt::format("{:.4g}", value.get<double>());
  return value.is_null() ? "" : value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string text_at(const nlohmann::json& object, const char* key) {
  return object.is_object() && object.contains(key) ? text_of(object.at(key)) : "";
}

}  // namespace wasp::tools
