// Append-only text file of whole lines. Lines gather in memory and go out in writes that end on a line and, where they
// can, on a page: the kernel lets SIGKILL cut a write only between pages, so a killed program leaves whole lines.
// A full or failing disk loses lines, never the file: the file is cut back to its last whole line and the loss counted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace wasp::tools {

class CsvFile {
 public:
  /// Creates or empties `path` and queues `header` (no newline; empty: none).
  /// Throws std::runtime_error naming the path and the system's reason.
  CsvFile(const std::filesystem::path& path, std::string_view header);
  ~CsvFile();
  CsvFile(const CsvFile&) = delete;
  CsvFile& operator=(const CsvFile&) = delete;

  /// Queues one line (no newline in it); writes out by itself once 64 KiB have gathered.
  void line(std::string_view text);
  /// Hands everything queued to the kernel.
  void flush();
  [[nodiscard]] std::uint64_t lines() const noexcept { return lines_; }
  /// Lines that the disk refused.
  [[nodiscard]] std::uint64_t failed_lines() const noexcept { return failed_lines_; }

 private:
  [[nodiscard]] std::size_t chunk_end(std::size_t from) const;
  bool write_chunk(std::string_view chunk);

  int fd_ = -1;
  std::uint64_t bytes_ = 0;  ///< of whole lines in the file
  std::uint64_t lines_ = 0, failed_lines_ = 0;
  std::string pending_;
};

}  // namespace wasp::tools
