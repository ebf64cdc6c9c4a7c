#include "calibration/toml_section.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <stdexcept>

namespace wasp::calibration {
namespace {

/// A TOML float: the shortest text that reads back to the same bits, never without a point or exponent.
std::string float_text(double value, std::string_view key) {
  if (!std::isfinite(value)) throw std::logic_error(fmt::format("calibration: {} is not finite", key));
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

/// A TOML basic string.
std::string quoted(std::string_view value) {
  std::string out = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) >= 0x20) out += c;
  }
  return out + '"';
}

}  // namespace

TomlSection& TomlSection::line(std::string_view key, const std::string& value, std::string_view remark) {
  const std::string text = fmt::format("{} = {}", key, value);
  lines_.push_back(remark.empty() ? text : fmt::format("{:<44}  # {}", text, remark));
  return *this;
}

TomlSection& TomlSection::number(std::string_view key, double value, std::string_view remark) {
  return line(key, float_text(value, key), remark);
}

TomlSection& TomlSection::whole(std::string_view key, long long value, std::string_view remark) {
  return line(key, fmt::format("{}", value), remark);
}

TomlSection& TomlSection::numbers(std::string_view key, std::span<const double> values, std::string_view remark) {
  std::vector<std::string> texts;
  for (const double v : values) texts.push_back(float_text(v, key));
  return line(key, fmt::format("[{}]", fmt::join(texts, ", ")), remark);
}

TomlSection& TomlSection::text(std::string_view key, std::string_view value, std::string_view remark) {
  return line(key, quoted(value), remark);
}

TomlSection& TomlSection::flag(std::string_view key, bool value, std::string_view remark) {
  return line(key, value ? "true" : "false", remark);
}

std::string TomlSection::toml() const {
  std::string out = fmt::format("[{}]\n", name_);
  for (const auto& l : lines_) out += l + "\n";
  return out;
}

}  // namespace wasp::calibration
