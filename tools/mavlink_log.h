// A recorded MAVLink log as one byte stream. What kind of file it is is told from its bytes: a raw stream of a line; a
// telemetry log, where 8 bytes of time stand before every frame (microseconds since 1970, high byte first as ground
// stations write it, or low byte first); or no MAVLink at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "messages/mavlink_frame.h"

namespace wasp::tools {

enum class LogKind : std::uint8_t { kRaw, kTlog, kTlogLittleEndian, kNotMavlink };
std::string_view name_of(LogKind kind);

struct MavlinkLog {
  struct Stamp {
    std::size_t offset;     ///< in `stream`: where the stamped frame starts
    std::uint64_t time_us;  ///< since 1970
  };
  LogKind kind = LogKind::kNotMavlink;
  std::string_view why;              ///< for kNotMavlink
  std::vector<std::uint8_t> stream;  ///< without times
  std::vector<Stamp> stamps;         ///< rising in offset; empty for a raw stream
  std::size_t file_bytes = 0;

  /// Time of the frame that starts at `offset`, if it has one.
  [[nodiscard]] std::optional<std::uint64_t> time_us(std::size_t offset) const;
};

/// `messages` are those a checksum can be verified for. Throws std::runtime_error with the path.
MavlinkLog read_mavlink_log(const std::filesystem::path& path, std::span<const mavlink::MessageInfo> messages);
MavlinkLog mavlink_log_of(std::vector<std::uint8_t> bytes, std::span<const mavlink::MessageInfo> messages);

/// What a start byte at the front of `bytes` claims, without looking at the checksum.
struct FrameClaim {
  std::size_t total = 0;  ///< bytes of the whole frame; may be more than there are
  std::uint32_t id = 0;
  std::uint8_t version = 2, sequence = 0, system_id = 0, component_id = 0, incompat_flags = 0;
};
std::optional<FrameClaim> claim_at(std::span<const std::uint8_t> bytes);

}  // namespace wasp::tools
