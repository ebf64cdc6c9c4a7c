// A CSV of named columns, read whole.
#include "tools/eval_truth.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "drivers/recording_folder.h"

namespace wasp::tools {
namespace {

using Row = std::map<std::string, std::string>;

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) {
    if (!field.empty() && field.back() == '\r') field.pop_back();
    fields.push_back(field);
  }
  return fields;
}

/// Rows of `file`; each also holds its line number under "#line".
std::vector<Row> read_csv(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<Row> rows;
  std::string line;
  if (!std::getline(in, line)) throw std::runtime_error(file.string() + ":1: empty table");
  const std::vector<std::string> names = split(line);
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.empty()) continue;
    const std::vector<std::string> fields = split(line);
    if (fields.size() != names.size())
      throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": " + std::to_string(fields.size()) +
                               " fields, the heading has " + std::to_string(names.size()));
    Row row;
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = fields[i];
    row["#line"] = std::to_string(number);
    row["#key"] = fields[0];
    rows.push_back(std::move(row));
  }
  return rows;
}

float number(const Row& row, const std::string& column, const std::filesystem::path& file) {
  try {
    return std::stof(row.at(column));
  } catch (const std::exception&) {
    throw std::runtime_error(file.string() + ":" + row.at("#line") + ": no number in column " + column);
  }
}

PlaneTruth plane_of(const Row& row, const std::filesystem::path& file) {
  const bool fit = row.contains("fit_nx");
  const std::string prefix = fit ? "fit_" : "", height = fit                               ? "fit_height_m"
                                                         : row.contains("camera_height_m") ? "camera_height_m"
                                                                                           : "height_m";
  return {Vec3(number(row, prefix + "nx", file), number(row, prefix + "ny", file), number(row, prefix + "nz", file))
              .normalized(),
          number(row, height, file)};
}

}  // namespace

std::map<std::string, PlaneTruth> read_plane_truth(const std::filesystem::path& folder) {
  std::map<std::string, PlaneTruth> truth;
  for (const char* name : {"floor_plane.csv", "table_plane.csv"}) {
    const std::filesystem::path file = folder / name;
    if (!std::filesystem::exists(file)) continue;
    for (const Row& row : read_csv(file)) {
      const bool published = row.contains("source") && row.at("source") != "fitted";
      if (!published) truth[row.at("#key")] = plane_of(row, file);
    }
  }
  return truth;
}

std::map<std::string, float> read_height_truth(const std::filesystem::path& folder) {
  std::map<std::string, float> truth;
  const std::filesystem::path file = folder / "gt_per_frame.csv";
  if (!std::filesystem::exists(file)) return truth;
  for (const Row& row : read_csv(file)) truth[row.at("#key")] = number(row, "height_along_axis_m", file);
  return truth;
}

std::string frame_key(const std::filesystem::path& file) {
  const std::string name = file.filename().string(), stem = name.substr(0, name.find('.'));
  constexpr std::string_view kSuffix = "_depth";
  if (stem.ends_with(kSuffix)) return stem.substr(0, stem.size() - kSuffix.size());
  const auto number = drivers::trailing_number(file);
  return number ? std::to_string(*number) : stem;
}

}  // namespace wasp::tools
