// What the kernel says of itself in /proc, /sys and /boot, below a root folder that tests replace by a canned one.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace wasp::tools {

class SystemTree {
 public:
  explicit SystemTree(std::filesystem::path root = "/") : root_(std::move(root)) {}

  /// Content without trailing white space; nullopt if the file is absent or may not be read. At most 4 MiB.
  [[nodiscard]] std::optional<std::string> text(std::string_view path) const;
  /// A file that may be gzip-compressed.
  [[nodiscard]] std::optional<std::string> unzipped(std::string_view path) const;
  [[nodiscard]] std::optional<long long> number(std::string_view path) const;
  [[nodiscard]] bool exists(std::string_view path) const;
  /// Names in a folder, sorted; empty if absent or closed to us.
  [[nodiscard]] std::vector<std::string> names(std::string_view folder) const;
  /// True if this is the machine itself and not a canned tree: only then may a check act.
  [[nodiscard]] bool real() const { return root_ == "/"; }

 private:
  [[nodiscard]] std::filesystem::path at(std::string_view path) const;
  std::filesystem::path root_;
};

/// "0-2,5" as a set of cores; what is not a number or a range is passed over ("managed_irq,domain,1" gives 1).
std::set<int> parse_cores(std::string_view text);
/// The reverse, shortest: "0-2,5"; "none" when empty.
std::string core_text(const std::set<int>& cores);
/// Value of `key=value` on a kernel command line, the last one wins; "" for a bare `key`; nullopt if absent.
std::optional<std::string> kernel_argument(std::string_view command_line, std::string_view key);
/// The choice in brackets of "always [madvise] never" or in parentheses of "none (full)"; "" if there is none.
std::string chosen(std::string_view text);
/// Words between white space.
std::vector<std::string> words(std::string_view text);

}  // namespace wasp::tools
