#include "tools/mavlink_log.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "tools/mavlink_scan.h"

namespace wasp::tools {
namespace {

using Bytes = std::span<const std::uint8_t>;
constexpr std::size_t kTimeBytes = 8;
// What a recorder's clock can have said: from 1970 on for recorders that count from their start, far beyond today.
constexpr std::uint64_t kLatest_us = 4'102'444'800'000'000;  // the year 2100

std::uint64_t time_of(Bytes bytes, bool high_first) {
  std::uint64_t time = 0;
  for (std::size_t i = 0; i < kTimeBytes; ++i) time = time << 8 | bytes[high_first ? i : kTimeBytes - 1 - i];
  return time;
}

struct Magic {
  std::string_view bytes, what;
};
constexpr std::array<Magic, 6> kOthers = {{{"\xA3\x95\x80", "a DataFlash log of ArduPilot"},
                                           {"ULog\x01\x12", "a ULog of PX4"},
                                           {"\x1F\x8B", "compressed (gzip)"},
                                           {"PK\x03\x04", "compressed (zip)"},
                                           {"\xFD" "7zXZ", "compressed (xz)"},
                                           {"\x28\xB5\x2F\xFD", "compressed (zstd)"}}};

std::string_view other_format(Bytes bytes) {
  for (const Magic& magic : kOthers)
    if (bytes.size() >= magic.bytes.size() &&
        std::equal(magic.bytes.begin(), magic.bytes.end(), bytes.begin(),
                   [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; }))
      return magic.what;
  return {};
}

/// How the frames stand behind one another: a time's length apart, by the byte order in which that is a likely time, or
/// without anything between them.
struct Gaps {
  std::size_t stamped_high = 0, stamped_low = 0, none = 0;
};

Gaps gaps_of(Bytes bytes, const std::vector<FoundFrame>& frames) {
  Gaps gaps;
  std::size_t end = 0;
  for (const FoundFrame& frame : frames) {
    if (frame.begin == end) ++gaps.none;
    if (frame.begin == end + kTimeBytes) {
      const std::uint64_t high = time_of(bytes.subspan(end), true), low = time_of(bytes.subspan(end), false);
      if (high <= kLatest_us && (low > kLatest_us || high >= low)) ++gaps.stamped_high;
      if (low <= kLatest_us && (high > kLatest_us || low > high)) ++gaps.stamped_low;
    }
    end = frame.end;
  }
  return gaps;
}

void keep(Bytes bytes, MavlinkLog& log) { log.stream.insert(log.stream.end(), bytes.begin(), bytes.end()); }

/// Takes the times out of what lies between two good frames (or behind the last): records of frames that cannot be
/// verified, as long as they follow one another; the rest is kept as it is.
void strip_gap(Bytes gap, bool high_first, MavlinkLog& log) {
  while (gap.size() > kTimeBytes) {
    const auto claim = claim_at(gap.subspan(kTimeBytes));
    if (!claim || time_of(gap, high_first) > kLatest_us || kTimeBytes + claim->total > gap.size()) break;
    log.stamps.push_back({log.stream.size(), time_of(gap, high_first)});
    keep(gap.subspan(kTimeBytes, claim->total), log);
    gap = gap.subspan(kTimeBytes + claim->total);
  }
  keep(gap, log);
}

void strip(Bytes bytes, const std::vector<FoundFrame>& frames, bool high_first, MavlinkLog& log) {
  std::size_t end = 0;
  for (const FoundFrame& frame : frames) {
    const std::size_t begin = std::max(end, frame.begin);  // a frame may begin in the signature of the one before
    const Bytes gap = bytes.subspan(end, begin - end);
    const bool stamped = gap.size() >= kTimeBytes;
    strip_gap(gap.first(gap.size() - (stamped ? kTimeBytes : 0)), high_first, log);
    if (stamped) log.stamps.push_back({log.stream.size(), time_of(gap.last(kTimeBytes), high_first)});
    keep(bytes.subspan(begin, frame.end - begin), log);
    end = frame.end;
  }
  strip_gap(bytes.subspan(end), high_first, log);
}

}  // namespace

std::string_view name_of(LogKind kind) {
  switch (kind) {
    case LogKind::kRaw:
      return "raw";
    case LogKind::kTlog:
      return "tlog";
    case LogKind::kTlogLittleEndian:
      return "tlog, low byte first";
    case LogKind::kNotMavlink:
      break;
  }
  return "not MAVLink";
}

std::optional<std::uint64_t> MavlinkLog::time_us(std::size_t offset) const {
  const auto at = std::lower_bound(stamps.begin(), stamps.end(), offset,
                                   [](const Stamp& stamp, std::size_t wanted) { return stamp.offset < wanted; });
  if (at == stamps.end() || at->offset != offset) return std::nullopt;
  return at->time_us;
}

std::optional<FrameClaim> claim_at(Bytes b) {
  if (b.empty() || (b[0] != mavlink::kStartV1 && b[0] != mavlink::kStartV2)) return std::nullopt;
  const bool v2 = b[0] == mavlink::kStartV2;
  const std::size_t header = v2 ? mavlink::kHeaderV2 : mavlink::kHeaderV1;
  if (b.size() < header) return std::nullopt;
  FrameClaim c;
  c.version = v2 ? 2 : 1;
  c.incompat_flags = v2 ? b[2] : std::uint8_t{0};
  const Bytes sender = b.subspan(v2 ? 4 : 2);
  c.sequence = sender[0], c.system_id = sender[1], c.component_id = sender[2], c.id = sender[3];
  if (v2) c.id |= static_cast<std::uint32_t>(sender[4]) << 8 | static_cast<std::uint32_t>(sender[5]) << 16;
  const bool is_signed = (c.incompat_flags & mavlink::kIncompatSigned) != 0;
  c.total = header + b[1] + mavlink::kChecksumBytes + (is_signed ? mavlink::kSignatureBytes : 0);
  if (c.system_id == 0 || c.component_id == 0) return std::nullopt;
  return c;
}

MavlinkLog mavlink_log_of(std::vector<std::uint8_t> bytes, std::span<const mavlink::MessageInfo> messages) {
  MavlinkLog log;
  log.file_bytes = bytes.size();
  log.why = bytes.empty() ? "empty" : other_format(bytes);
  if (!log.why.empty()) return log;
  mavlink::Parser parser(messages);
  const std::vector<FoundFrame> frames = find_frames(bytes, parser, [] { return std::size_t{4096}; });
  if (frames.empty()) {
    log.why = "no frame with a good checksum in it";
    return log;
  }
  const Gaps gaps = gaps_of(bytes, frames);
  if (gaps.stamped_high + gaps.stamped_low > gaps.none) {
    const bool high_first = gaps.stamped_high >= gaps.stamped_low;
    log.kind = high_first ? LogKind::kTlog : LogKind::kTlogLittleEndian;
    strip(bytes, frames, high_first, log);
  } else {
    log.kind = LogKind::kRaw;
    log.stream = std::move(bytes);
  }
  return log;
}

MavlinkLog read_mavlink_log(const std::filesystem::path& path, std::span<const mavlink::MessageInfo> messages) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path.string() + ": cannot be read");
  return mavlink_log_of(std::vector<std::uint8_t>(std::istreambuf_iterator<char>(file), {}), messages);
}

}  // namespace wasp::tools
