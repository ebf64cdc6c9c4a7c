// What was found wrong with a recording: a line each, with file and line where there is one, and a count of each kind.
// Of the same kind in the same file the first kShown are told one by one, the rest as a number: nothing is lost, and a
// log of a hundred thousand lines stays readable.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace wasp::drivers {

enum class ProblemKind : std::uint8_t {
  kUnreadable,  ///< a line that makes no sense
  kMissing,     ///< a file that is named and not there
  kDamaged,     ///< a file that is there and no good
  kOtherSize,   ///< an image of another size than most
  kUnordered,   ///< a time before that of its neighbours
  kDuplicate,   ///< a time that was there before
  kUnlisted,    ///< an image that no index names
  kAlone,       ///< a part of an instant whose other part is not there
  kCount,
};
inline constexpr std::size_t kProblemKinds = static_cast<std::size_t>(ProblemKind::kCount);

/// "unreadable lines", "missing files", ...
std::string_view name_of(ProblemKind kind);

class RecordingProblems {
 public:
  static constexpr std::size_t kShown = 20;

  /// `file` is what the problem is counted under; `text` is the whole message and names it.
  void add(ProblemKind kind, const std::filesystem::path& file, std::string text);
  void add_line(ProblemKind kind, const std::filesystem::path& file, int line, const std::string& what);
  /// Adds `count` of them under one line of text.
  void add_many(ProblemKind kind, std::size_t count, std::string text);
  void append(const RecordingProblems& other);

  /// Every line to show; where some were left out, a line that says how many.
  [[nodiscard]] std::vector<std::string> lines() const;
  [[nodiscard]] std::size_t count(ProblemKind kind) const { return counts_[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] std::size_t total() const;

 private:
  std::vector<std::string> lines_;
  std::array<std::size_t, kProblemKinds> counts_{};
  std::map<std::pair<std::string, ProblemKind>, std::size_t> by_file_;
};

}  // namespace wasp::drivers
