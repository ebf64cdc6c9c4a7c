#include "tools/mavlink_damage.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <random>

namespace wasp::tools {
namespace {

using Bytes = std::span<const std::uint8_t>;
using Random = std::mt19937;
constexpr std::array<unsigned, 3> kRates = {20, 100, 1000};  ///< one damage in so many bytes

enum Kind : unsigned { kFlip = 1, kDrop = 2, kInsert = 4 };
struct Campaign {
  const char* name;
  unsigned kinds;
};
constexpr std::array<Campaign, 4> kCampaigns = {
    {{"bit_flips", kFlip}, {"drops", kDrop}, {"insertions", kInsert}, {"mixed", kFlip | kDrop | kInsert}}};

/// A stream after damage, and where the undamaged frames lie in it.
struct Damaged {
  std::vector<std::uint8_t> stream;
  struct Extent {
    std::size_t begin, end;
  };
  std::vector<Extent> undamaged;
  std::vector<std::size_t> in_signature;  ///< beginnings of frames that are damaged in their signature alone
  std::uint64_t bytes = 0;
};

class Damager {
 public:
  Damager(unsigned kinds, unsigned rate, unsigned seed) : kinds_(kinds), rate_(rate), random_(seed) {}

  /// Bytes outside of frames are copied untouched.
  Damaged run(Bytes stream, const std::vector<FoundFrame>& frames) {
    std::size_t at = 0;
    for (const FoundFrame& frame : frames) {
      if (frame.begin < at) continue;  // lies in the signature of the one before
      out_.stream.insert(out_.stream.end(), stream.begin() + static_cast<std::ptrdiff_t>(at),
                         stream.begin() + static_cast<std::ptrdiff_t>(frame.begin));
      damage(stream, frame);
      at = frame.end;
    }
    out_.stream.insert(out_.stream.end(), stream.begin() + static_cast<std::ptrdiff_t>(at), stream.end());
    return std::move(out_);
  }

 private:
  void damage(Bytes stream, const FoundFrame& frame) {
    // The frame before lost its last byte and the one that follows is the same: nobody could tell which of them is gone.
    bool whole = !start_taken_, checked = whole;
    start_taken_ = false;
    const std::size_t checked_end = frame.end - (frame.is_signed ? mavlink::kSignatureBytes : 0);
    std::size_t begin = out_.stream.size();
    for (std::size_t i = frame.begin; i < frame.end; ++i) {
      const unsigned kind = random_() % rate_ == 0 ? pick() : 0;
      out_.bytes += kind != 0 ? 1 : 0;
      if (kind == kInsert) out_.stream.push_back(static_cast<std::uint8_t>(random_()));
      if (kind == kInsert && i == frame.begin) begin = out_.stream.size();  // between two frames
      if (kind != kDrop)
        out_.stream.push_back(static_cast<std::uint8_t>(stream[i] ^ (kind == kFlip ? 1u << random_() % 8 : 0)));
      if (kind == kDrop && i + 1 == frame.end && frame.end < stream.size()) start_taken_ = stream[i] == stream[i + 1];
      const bool harmless = kind == 0 || (kind == kInsert && i == frame.begin);
      whole = whole && harmless;
      checked = checked && (harmless || i >= checked_end);
    }
    if (checked && !whole) out_.in_signature.push_back(begin);
    if (whole) out_.undamaged.push_back({begin, out_.stream.size()});
  }
  unsigned pick() {
    while (true)
      if (const unsigned kind = 1u << random_() % 3; (kind & kinds_) != 0) return kind;
  }

  unsigned kinds_, rate_;
  Random random_;
  Damaged out_;
  bool start_taken_ = false;
};

std::size_t random_piece(Random& random) { return 1 + random() % 64; }

/// Bit by bit, unlike messages/checksum.h.
std::uint16_t plain_crc(Bytes bytes, std::uint8_t extra) {
  unsigned crc = 0xFFFF;
  const auto add = [&crc](unsigned byte) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0x8408u : crc >> 1;
  };
  for (const std::uint8_t byte : bytes) add(byte);
  add(extra);
  return static_cast<std::uint16_t>(crc);
}

bool checksum_holds(Bytes stream, const FoundFrame& f, std::span<const mavlink::MessageInfo> messages) {
  const mavlink::MessageInfo* info = mavlink::find_message(f.id, messages);
  const std::size_t end = f.payload + f.length;
  if (info == nullptr || end + 2 > stream.size()) return false;
  return plain_crc(stream.subspan(f.begin + 1, end - f.begin - 1), info->crc_extra) ==
         (stream[end] | stream[end + 1] << 8);
}

/// Where a frame's checksum has spoken for all of it; a signature that nobody verifies may be of anything.
std::size_t spoken_for(const FoundFrame& f) { return f.end - (f.is_signed ? mavlink::kSignatureBytes : 0); }

void judge(const Damaged& damaged, const std::vector<FoundFrame>& found,
           std::span<const mavlink::MessageInfo> messages, DamageResult& result) {
  auto next = found.begin();
  std::vector<bool> sent(found.size(), false);
  for (const Damaged::Extent& frame : damaged.undamaged) {
    while (next != found.end() && next->begin < frame.begin) ++next;
    if (next != found.end() && next->begin == frame.begin && next->end == frame.end) {
      sent[static_cast<std::size_t>(next - found.begin())] = true;
      continue;
    }
    const bool taken = next != found.begin() && spoken_for(*(next - 1)) > frame.begin;
    ++(taken ? result.lost_to_collisions : result.lost);
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (sent[i]) continue;
    if (std::binary_search(damaged.in_signature.begin(), damaged.in_signature.end(), found[i].begin)) {
      ++result.other_signature;
      continue;
    }
    ++(checksum_holds(damaged.stream, found[i], messages) ? result.collisions : result.bad_checksum);
  }
  result.undamaged += damaged.undamaged.size();
  result.accepted += found.size();
}

DamageResult run(const Campaign& campaign, Bytes stream, const std::vector<FoundFrame>& frames,
                 std::span<const mavlink::MessageInfo> messages, unsigned seeds) {
  DamageResult result;
  result.name = campaign.name;
  for (const unsigned rate : kRates) {
    for (unsigned seed = 0; seed < seeds; ++seed, ++result.streams) {
      const Damaged damaged = Damager(campaign.kinds, rate, seed * 7919 + rate).run(stream, frames);
      std::vector<std::uint8_t> tail(damaged.stream);
      tail.resize(tail.size() + 2 * mavlink::kMaxFrame);  // closes every claim still open
      mavlink::Parser parser(messages);
      Random random(seed);
      judge({tail, damaged.undamaged, damaged.in_signature, 0}, find_frames(tail, parser, [&random] { return random_piece(random); }),
            messages, result);
      result.damaged_bytes += damaged.bytes;
    }
  }
  return result;
}

bool same(const std::vector<FoundFrame>& a, const std::vector<FoundFrame>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const FoundFrame& x, const FoundFrame& y) {
    return x.begin == y.begin && x.end == y.end && x.id == y.id;
  });
}

}  // namespace

ChunkResult chunk_campaign(Bytes stream, const std::vector<FoundFrame>& frames,
                           std::span<const mavlink::MessageInfo> messages) {
  ChunkResult result;
  const auto pass = [&](auto&& next_piece) {
    mavlink::Parser parser(messages);
    ++result.passes;
    if (!same(find_frames(stream, parser, next_piece), frames)) ++result.different;
  };
  for (std::size_t n = 1; n <= 64; ++n) pass([n] { return n; });
  for (unsigned seed = 0; seed < 16; ++seed) {
    Random random(seed);
    pass([&random] { return random_piece(random); });
  }
  return result;
}

std::vector<DamageResult> damage_campaigns(Bytes stream, const std::vector<FoundFrame>& frames,
                                           std::span<const mavlink::MessageInfo> messages, unsigned seeds) {
  std::vector<DamageResult> results;
  for (const Campaign& campaign : kCampaigns) results.push_back(run(campaign, stream, frames, messages, seeds));
  return results;
}

}  // namespace wasp::tools
