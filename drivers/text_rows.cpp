#include "drivers/text_rows.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>

namespace wasp::drivers {
namespace {

constexpr TimeNs kLatest = INT64_MAX / 2;  ///< the year 2116: differences of two instants up to it fit
constexpr std::string_view kBlank = " \t\r\v\f";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

/// Where there are commas (or semicolons), they part the fields and an empty one counts; else blanks do.
void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  const bool commas = line.find_first_of(",;") != std::string_view::npos;
  while (!line.empty()) {
    const auto end = line.find_first_of(commas ? std::string_view(",;") : kBlank);
    fields.push_back(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) return;
    line = commas ? line.substr(end + 1) : trimmed(line.substr(end));
    if (commas && trimmed(line).empty()) return;  // a comma at the end parts nothing
  }
}

bool in_range(TimeNs time_ns) { return time_ns >= 0 && time_ns <= kLatest; }

bool through_double(std::string_view text, double scale, TimeNs& out) {
  double value = 0;
  if (!parse_number(text, value) || value < 0 || value * scale > static_cast<double>(kLatest)) return false;
  out = std::llround(value * scale);
  return true;
}

bool has_exponent(std::string_view text) { return text.find_first_of("eE") != std::string_view::npos; }

}  // namespace

void visit_rows(const std::filesystem::path& file, const std::function<void(const TextRow&)>& visit,
                const std::function<void(std::string_view)>& comment) {
  const bool regular = std::filesystem::is_regular_file(file);  // first: to open a pipe would wait for its writer
  std::ifstream in;
  if (regular) in.open(file, std::ios::binary);
  if (!regular || !in) throw std::runtime_error(file.string() + ": cannot be read");
  TextRow row;
  std::string line;
  while (std::getline(in, line)) {
    ++row.line;
    if (line.find('\0') != std::string::npos) throw std::runtime_error(file.string() + ": is no text");
    std::string_view text = line;
    if (row.line == 1 && text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    const auto hash = text.find('#');
    if (hash != std::string_view::npos && comment) comment(trimmed(text.substr(hash + 1)));
    text = trimmed(text.substr(0, hash));
    if (text.empty()) continue;
    split(text, row.fields);
    visit(row);
  }
}

bool parse_seconds(std::string_view text, TimeNs& out) {
  if (has_exponent(text)) return through_double(text, 1e9, out);
  const auto dot = text.find('.');
  std::string fraction(dot == std::string_view::npos ? std::string_view{} : text.substr(dot + 1));
  if (fraction.find_first_not_of("0123456789") != std::string::npos) return false;
  if (fraction.size() > 9) fraction.resize(9);
  fraction.append(9 - fraction.size(), '0');
  const std::string digits = std::string(text.substr(0, dot)) + fraction;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), out);
  return error == std::errc{} && end == digits.data() + digits.size() && dot != 0 && !text.empty() && in_range(out);
}

bool parse_nanoseconds(std::string_view text, TimeNs& out) {
  if (has_exponent(text)) return through_double(text, 1.0, out);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc{} && end == text.data() + text.size() && in_range(out);
}

bool parse_number(std::string_view text, double& out) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc{} && end == text.data() + text.size() && std::isfinite(out);
}

bool parse_numbers(const TextRow& row, std::size_t first, std::span<double> out) {
  if (row.fields.size() < first + out.size()) return false;
  for (std::size_t i = 0; i < out.size(); ++i)
    if (!parse_number(row.fields[first + i], out[i])) return false;
  return true;
}

}  // namespace wasp::drivers
