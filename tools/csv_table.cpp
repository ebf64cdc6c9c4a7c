#include "tools/csv_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

namespace wasp::tools {
namespace {

std::vector<std::string> split(std::string_view line) {
  std::vector<std::string> fields;
  for (std::size_t from = 0;;) {
    const std::size_t comma = line.find(',', from);
    fields.emplace_back(line.substr(from, comma - from));
    if (comma == std::string_view::npos) return fields;
    from = comma + 1;
  }
}

template <class T>
T parse(std::string_view text, T otherwise) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? value : otherwise;
}

}  // namespace

std::optional<CsvTable> CsvTable::read(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  CsvTable table;
  table.content_.assign(std::istreambuf_iterator<char>(in), {});
  const std::string& content = table.content_;
  const std::size_t header_end = content.find('\n');
  if (header_end == std::string::npos) return std::nullopt;
  table.names_ = split(std::string_view(content).substr(0, header_end));
  const auto commas = static_cast<std::ptrdiff_t>(table.names_.size() - 1);
  for (std::size_t from = header_end + 1; from < content.size();) {
    const std::size_t end = content.find('\n', from);
    table.cut_ = end == std::string::npos;
    if (table.cut_) break;
    const std::string_view line = std::string_view(content).substr(from, end - from);
    if (std::count(line.begin(), line.end(), ',') == commas)
      table.row_starts_.push_back(from);
    else
      ++table.bad_lines_;
    from = end + 1;
  }
  return table;
}

std::optional<std::size_t> CsvTable::column(std::string_view name) const {
  const auto it = std::find(names_.begin(), names_.end(), name);
  if (it == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(it - names_.begin());
}

std::string_view CsvTable::text(std::size_t row, std::size_t column) const {
  if (row >= rows() || column >= names_.size()) return {};
  std::size_t from = row_starts_[row];
  for (std::size_t i = 0; i < column; ++i) from = content_.find(',', from) + 1;
  return std::string_view(content_).substr(from, content_.find_first_of(",\n", from) - from);
}

std::vector<double> CsvTable::numbers(std::string_view name) const {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> values(rows(), kNan);
  if (const auto c = column(name))
    for (std::size_t i = 0; i < rows(); ++i) values[i] = parse(text(i, *c), kNan);
  return values;
}

std::vector<std::int64_t> CsvTable::integers(std::string_view name) const {
  std::vector<std::int64_t> values(rows(), 0);
  if (const auto c = column(name))
    for (std::size_t i = 0; i < rows(); ++i) values[i] = parse<std::int64_t>(text(i, *c), 0);
  return values;
}

std::vector<std::string> CsvTable::texts(std::string_view name) const {
  std::vector<std::string> values(rows());
  if (const auto c = column(name))
    for (std::size_t i = 0; i < rows(); ++i) values[i] = text(i, *c);
  return values;
}

}  // namespace wasp::tools
