// What a log holds: every frame with its place in the stream, counts per id and per sender, and what could not be
// verified or did not verify. Frames come from the real parser; what lies between them is looked at afterwards.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "messages/frame_parser.h"

namespace wasp::tools {

struct FoundFrame {
  std::size_t begin = 0, end = 0;  ///< in the stream
  std::uint32_t id = 0;
  std::uint8_t version = 2, sequence = 0, system_id = 0, component_id = 0;
  std::size_t payload = 0, length = 0;  ///< of the payload: where, how many bytes
  bool is_signed = false, is_verified = false;
};

/// One sender, as its frames say.
struct SourceScan {
  std::uint64_t frames = 0, unknown_frames = 0;
  std::uint64_t gaps = 0, lost = 0;  ///< places where numbers are missing, and how many are
  std::uint64_t repeated = 0;        ///< frames with the number of the one before
  std::uint8_t last_sequence = 0;
};

struct LogScan {
  std::vector<FoundFrame> frames;
  std::map<std::uint32_t, std::uint64_t> ids, unknown_ids;
  std::array<std::uint64_t, 2> versions{};  ///< frames of version 1, 2
  std::uint64_t signed_frames = 0;
  std::uint64_t bad_checksums = 0;      ///< known id, room for the whole frame, checksum wrong
  std::uint64_t refused_frames = 0;     ///< checksum right, but its signature was not: only where a key is given
  std::uint64_t unsupported_flags = 0;  ///< incompatibility bits other than "signed"
  std::uint64_t stray_bytes = 0;        ///< in no frame
  std::uint64_t truncated_bytes = 0;    ///< of a frame the log ends in
  std::map<std::pair<int, int>, SourceScan> sources;  ///< by system and component
  mavlink::Counts parser;                             ///< what the parser itself counted
};

/// `check`, if any, judges signatures; refused frames are in the counts of the parser and of the check only.
LogScan scan(std::span<const std::uint8_t> stream, std::span<const mavlink::MessageInfo> messages,
             mavlink::SignatureCheck* check = nullptr);

/// The frames of a stream fed in pieces whose lengths `next_piece()` says.
template <class NextPiece>
std::vector<FoundFrame> find_frames(std::span<const std::uint8_t> stream, mavlink::Parser& parser,
                                    NextPiece&& next_piece) {
  std::vector<FoundFrame> frames;
  std::size_t from = 0;
  const auto add = [&](const mavlink::Frame& f) noexcept {
    const auto rest = stream.subspan(from);
    const auto at = std::search(rest.begin(), rest.end(), f.wire.begin(), f.wire.end());
    const std::size_t begin = from + static_cast<std::size_t>(at - rest.begin());
    // A signature that nobody verified may hold the start of the next frame.
    const bool doubtful = f.is_signed && !f.is_verified;
    from = begin + f.wire.size() - (doubtful ? mavlink::kSignatureBytes : 0);
    const auto header = static_cast<std::size_t>(f.payload - f.wire.data());
    frames.push_back({begin, begin + f.wire.size(), f.message_id, f.version, f.sequence, f.system_id, f.component_id,
                      begin + header, f.length, f.is_signed, f.is_verified});
  };
  for (auto rest = stream; !rest.empty();) {
    const std::size_t n = std::min<std::size_t>(next_piece(), rest.size());
    parser.feed(rest.first(n), add);
    rest = rest.subspan(n);
  }
  return frames;
}

}  // namespace wasp::tools
