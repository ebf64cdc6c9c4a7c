// A CSV file read back: column names from the first line, fields by name. A last line without a newline (a writer
// killed in the middle) is dropped and said so; a line with the wrong number of fields is skipped and counted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace wasp::tools {

class CsvTable {
 public:
  /// nullopt if the file cannot be read or has no header line.
  static std::optional<CsvTable> read(const std::filesystem::path& path);

  [[nodiscard]] std::size_t rows() const noexcept { return row_starts_.size(); }
  /// Index of a column, nullopt if absent.
  [[nodiscard]] std::optional<std::size_t> column(std::string_view name) const;
  /// Field as text; empty when out of range.
  [[nodiscard]] std::string_view text(std::size_t row, std::size_t column) const;
  /// Whole columns; an absent column or an unreadable field gives NaN, respectively 0.
  [[nodiscard]] std::vector<double> numbers(std::string_view name) const;
  [[nodiscard]] std::vector<std::int64_t> integers(std::string_view name) const;
  [[nodiscard]] std::vector<std::string> texts(std::string_view name) const;

  [[nodiscard]] std::uint64_t bad_lines() const noexcept { return bad_lines_; }
  [[nodiscard]] bool cut() const noexcept { return cut_; }  ///< the last line was incomplete

 private:
  std::string content_;
  std::vector<std::string> names_;
  std::vector<std::size_t> row_starts_;
  std::uint64_t bad_lines_ = 0;
  bool cut_ = false;
};

}  // namespace wasp::tools
