#include "tools/mavlink_scan.h"

#include "messages/checksum.h"
#include "tools/mavlink_log.h"

namespace wasp::tools {
namespace {

using Bytes = std::span<const std::uint8_t>;

class Scanner {
 public:
  Scanner(Bytes stream, std::span<const mavlink::MessageInfo> messages) : stream_(stream), messages_(messages) {}

  LogScan run(mavlink::SignatureCheck* check) {
    mavlink::Parser parser(messages_);
    if (check != nullptr) parser.check_signatures(*check);
    scan_.frames = find_frames(stream_, parser, [] { return std::size_t{4096}; });
    scan_.parser = parser.counts();
    std::size_t end = 0;
    for (const FoundFrame& frame : scan_.frames) {
      look_between(end, frame.begin);
      count(frame);
      end = std::max(end, frame.end);
    }
    look_between(end, stream_.size());
    return std::move(scan_);
  }

 private:
  void count(const FoundFrame& f) {
    ++scan_.ids[f.id];
    ++scan_.versions[f.version - 1];
    scan_.signed_frames += f.is_signed ? 1 : 0;
    ++follow(f.system_id, f.component_id, f.sequence).frames;
  }

  SourceScan& follow(std::uint8_t system, std::uint8_t component, std::uint8_t sequence) {
    SourceScan& source = scan_.sources[{system, component}];
    const auto step = static_cast<std::uint8_t>(sequence - source.last_sequence);
    if (source.frames + source.unknown_frames > 0) {
      if (step == 0) ++source.repeated;
      if (step > 1) ++source.gaps, source.lost += step - 1u;
    }
    source.last_sequence = sequence;
    return source;
  }

  /// What lies between two good frames: frames nobody can verify, as long as they follow one another, damaged ones, rest.
  void look_between(std::size_t begin, std::size_t end) {
    while (begin < end) {
      const auto claim = claim_at(stream_.subspan(begin, end - begin));
      const bool whole = claim && begin + claim->total <= end;
      if (!claim) {
        const bool cut = end == stream_.size() && end - begin < mavlink::kHeaderV2 && is_start(stream_[begin]);
        ++(cut ? scan_.truncated_bytes : scan_.stray_bytes);
        ++begin;
        continue;
      }
      if (!whole) return overrun(begin, end);
      take(*claim, begin + claim->total == end || is_start(stream_[begin + claim->total]), begin);
    }
  }

  /// A claim with room for the whole frame. It counts if what follows it looks like a frame, else it was a stray byte.
  void take(const FrameClaim& claim, bool followed, std::size_t& begin) {
    if (!followed) {
      ++scan_.stray_bytes, ++begin;
      return;
    }
    const mavlink::MessageInfo* known = mavlink::find_message(claim.id, messages_);
    if ((claim.incompat_flags & ~mavlink::kIncompatSigned) != 0) {
      ++scan_.unsupported_flags;
    } else if (known != nullptr) {
      ++(checksum_holds(stream_.subspan(begin, claim.total), *known) ? scan_.refused_frames : scan_.bad_checksums);
    } else {
      ++scan_.unknown_ids[claim.id];
      ++follow(claim.system_id, claim.component_id, claim.sequence).unknown_frames;
    }
    begin += claim.total;
  }

  /// A claim that reaches beyond what is left: the log ends in it, or a damaged frame before a good one.
  void overrun(std::size_t begin, std::size_t end) {
    if (end == stream_.size()) {
      scan_.truncated_bytes += end - begin;
    } else {
      ++scan_.bad_checksums;
      scan_.stray_bytes += end - begin;
    }
  }
  static bool checksum_holds(Bytes wire, const mavlink::MessageInfo& info) {
    const std::size_t header = wire[0] == mavlink::kStartV2 ? mavlink::kHeaderV2 : mavlink::kHeaderV1;
    const std::size_t end = header + wire[1];
    const auto crc = mavlink::crc_add(mavlink::crc_add(mavlink::kCrcInitial, wire.subspan(1, end - 1)), info.crc_extra);
    return crc == (wire[end] | wire[end + 1] << 8);
  }
  static bool is_start(std::uint8_t byte) { return byte == mavlink::kStartV1 || byte == mavlink::kStartV2; }

  Bytes stream_;
  std::span<const mavlink::MessageInfo> messages_;
  LogScan scan_;
};

}  // namespace

LogScan scan(Bytes stream, std::span<const mavlink::MessageInfo> messages, mavlink::SignatureCheck* check) {
  return Scanner(stream, messages).run(check);
}

}  // namespace wasp::tools
