// A section of a TOML file in the order it was filled. Numbers keep every bit; what is not finite is refused.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace wasp::calibration {

class TomlSection {
 public:
  TomlSection() = default;
  explicit TomlSection(std::string name) : name_(std::move(name)) {}

  /// `remark` is written behind the value. Throws std::logic_error on a number that is not finite.
  TomlSection& number(std::string_view key, double value, std::string_view remark = "");
  TomlSection& whole(std::string_view key, long long value, std::string_view remark = "");
  TomlSection& numbers(std::string_view key, std::span<const double> values, std::string_view remark = "");
  TomlSection& text(std::string_view key, std::string_view value, std::string_view remark = "");
  TomlSection& flag(std::string_view key, bool value, std::string_view remark = "");

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] bool empty() const { return lines_.empty(); }
  /// "[name]" and its lines.
  [[nodiscard]] std::string toml() const;
  /// The lines without the head, for a screen.
  [[nodiscard]] const std::vector<std::string>& lines() const { return lines_; }

 private:
  TomlSection& line(std::string_view key, const std::string& value, std::string_view remark);

  std::string name_;
  std::vector<std::string> lines_;
};

}  // namespace wasp::calibration
