#include "shm/time_namespace.h"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>

namespace wasp::shm {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// Added to the machine's CLOCK_MONOTONIC for the children of a process [ns]; time_namespaces(7).
std::optional<std::int64_t> monotonic_offset_ns(const std::string& process) {
  std::ifstream file("/proc/" + process + "/timens_offsets");
  std::string clock;
  std::int64_t seconds = 0, nanoseconds = 0;
  while (file >> clock >> seconds >> nanoseconds)
    if (clock == "monotonic" || clock == "1") return seconds * kSecond_ns + nanoseconds;
  return std::nullopt;
}

}  // namespace

std::string foreign_clock(pid_t pid) {
  std::error_code unreadable;
  const auto space = [&](const std::string& p) {
    return std::filesystem::read_symlink("/proc/" + p + "/ns/time", unreadable).string();
  };
  if (space("self") == space(std::to_string(pid)) && !unreadable) return {};
  const auto own = monotonic_offset_ns("self"), other = monotonic_offset_ns(std::to_string(pid));
  if (!own || !other || *own == *other) return {};
  const std::int64_t ahead_ns = *other - *own;
  return "process " + std::to_string(pid) + " lives in another time namespace: its CLOCK_MONOTONIC is " +
         std::to_string(std::abs(ahead_ns) / kSecond_ns) + " s " + (ahead_ns > 0 ? "ahead of" : "behind") +
         " this one's";
}

}  // namespace wasp::shm
