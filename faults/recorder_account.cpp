#include "faults/recorder_account.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace wasp::faults {
namespace {

namespace fs = std::filesystem;

/// Whole lines behind the heading.
std::uint64_t rows_of(const fs::path& table) {
  std::ifstream file(table, std::ios::binary);
  std::uint64_t lines = 0;
  for (char c = 0; file.get(c);) lines += c == '\n' ? 1 : 0;
  return lines == 0 ? 0 : lines - 1;
}

}  // namespace

RecorderAccount read_account(const fs::path& folder) {
  RecorderAccount a;
  std::ifstream file(folder / "log/record.json");
  const auto account = nlohmann::json::parse(file, nullptr, false);
  if (!account.is_object() || !account.contains("topics")) {
    a.wrong = "the recorder left no account";
    return a;
  }
  for (const auto& topic : account["topics"]) {
    a.lost += topic.value("lost", std::uint64_t{0});
    const bool table = topic.value("type", "") != "Frame" && topic.value("kept", false);
    if (table) a.taken += topic.value("recorded", std::uint64_t{0});
    if (!table) a.lost += topic.value("refused_by_disk", std::uint64_t{0});
  }
  a.refused = account.value("lines_refused_by_disk", std::uint64_t{0});
  for (const char* table : {"imu", "attitude", "cues", "commands", "truth"})
    a.on_disk += rows_of(folder / "log" / (std::string(table) + ".csv"));
  if (a.on_disk + a.refused != a.taken)
    a.wrong = fmt::format("the recorder took {} messages, {} are on its disk and {} counted as refused", a.taken,
                          a.on_disk, a.refused);
  return a;
}

}  // namespace wasp::faults
