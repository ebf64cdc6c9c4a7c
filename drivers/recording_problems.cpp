#include "drivers/recording_problems.h"

#include <numeric>

namespace wasp::drivers {

std::string_view name_of(ProblemKind kind) {
  static constexpr std::array<std::string_view, kProblemKinds> kNames = {
      "unreadable lines", "missing files", "damaged files",   "images of another size",
      "out of order",     "duplicates",    "unlisted images", "without their partner"};
  return kNames.at(static_cast<std::size_t>(kind));
}

void RecordingProblems::add(ProblemKind kind, const std::filesystem::path& file, std::string text) {
  ++counts_[static_cast<std::size_t>(kind)];
  if (++by_file_[{file.string(), kind}] <= kShown) lines_.push_back(std::move(text));
}

void RecordingProblems::add_line(ProblemKind kind, const std::filesystem::path& file, int line,
                                 const std::string& what) {
  add(kind, file, file.string() + ":" + std::to_string(line) + ": " + what);
}

void RecordingProblems::add_many(ProblemKind kind, std::size_t count, std::string text) {
  counts_[static_cast<std::size_t>(kind)] += count;
  lines_.push_back(std::move(text));
}

void RecordingProblems::append(const RecordingProblems& other) {
  lines_.insert(lines_.end(), other.lines_.begin(), other.lines_.end());
  for (std::size_t i = 0; i < kProblemKinds; ++i) counts_[i] += other.counts_[i];
  for (const auto& [key, count] : other.by_file_) by_file_[key] += count;
}

std::vector<std::string> RecordingProblems::lines() const {
  std::vector<std::string> lines = lines_;
  for (const auto& [key, count] : by_file_)
    if (count > kShown)
      lines.push_back(key.first + ": " + std::string(name_of(key.second)) + ": " + std::to_string(count - kShown) +
                      " more");
  return lines;
}

std::size_t RecordingProblems::total() const {
  return std::accumulate(counts_.begin(), counts_.end(), std::size_t{0});
}

}  // namespace wasp::drivers
