#include "messages/frame_parser.h"

#include <cstring>

#include "messages/checksum.h"

namespace wasp::mavlink {
namespace {

bool same_sender(const Frame& a, const Frame& b) noexcept {
  return a.system_id == b.system_id && a.component_id == b.component_id;
}

}  // namespace

std::size_t Parser::take(std::span<const std::uint8_t> bytes) noexcept {
  if (head_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + head_, available());
    tail_ -= head_;
    head_ = 0;
  }
  const std::size_t n = std::min(bytes.size(), buffer_.size() - tail_);
  std::memcpy(buffer_.data() + tail_, bytes.data(), n);
  tail_ += n;
  return n;
}

void Parser::drop(std::size_t n) noexcept {
  head_ += n;
  offset_ += n;
}

void Parser::reset() noexcept {
  counts_.skipped_bytes += available();
  drop(available());
  due_ = counted_until_ = signature_until_ = offset_;
}

/// Leaves a frame behind, but for a signature that may hold bytes of the next one.
void Parser::consume(const Claim& claim) noexcept {
  const bool doubtful = claim.frame.is_signed && !claim.frame.is_verified;
  const std::size_t searched = doubtful ? kSignatureBytes : 0;
  drop(claim.total - searched);
  due_ = counted_until_ = signature_until_ = offset_ + searched;
}

bool Parser::next(Frame& frame) noexcept {
  while (available() > 0) {
    Claim claim;
    switch (examine(claim)) {
      case Verdict::kNeedMore:
        return false;
      case Verdict::kNotAFrame:
        if (offset_ >= signature_until_) ++counts_.skipped_bytes;
        drop(1);
        break;
      case Verdict::kPassOver:
        drop(claim.total);
        break;
      case Verdict::kRefused:
        consume(claim);
        break;
      case Verdict::kGood:
        consume(claim);
        frame = claim.frame;
        return true;
    }
  }
  return false;
}

/// Fills `claim` from the header `at` bytes behind head_; false if it is not all there yet.
bool Parser::read_header(std::size_t at, Claim& claim) const noexcept {
  if (available() <= at) return false;
  const std::uint8_t* p = buffer_.data() + head_ + at;
  const bool v2 = p[0] == kStartV2;
  claim.header = v2 ? kHeaderV2 : kHeaderV1;
  if (available() < at + claim.header) return false;
  Frame& f = claim.frame;
  f.version = v2 ? 2 : 1;
  f.length = p[1];
  claim.incompat_flags = v2 ? p[2] : std::uint8_t{0};
  p += v2 ? 4 : 2;
  f.sequence = p[0];
  f.system_id = p[1];
  f.component_id = p[2];
  f.message_id = v2 ? p[3] | static_cast<std::uint32_t>(p[4]) << 8 | static_cast<std::uint32_t>(p[5]) << 16 : p[3];
  f.is_signed = (claim.incompat_flags & kIncompatSigned) != 0;
  claim.total = claim.header + f.length + kChecksumBytes + (f.is_signed ? kSignatureBytes : 0);
  return true;
}

/// Decides on the byte at head_.
Parser::Verdict Parser::examine(Claim& claim) noexcept {
  const std::uint8_t start = buffer_[head_];
  if (start != kStartV1 && start != kStartV2) return Verdict::kNotAFrame;
  if (!read_header(0, claim)) return Verdict::kNeedMore;
  if (claim.frame.system_id == 0 || claim.frame.component_id == 0) return refuse_header();
  if ((claim.incompat_flags & ~kIncompatSigned) != 0)
    return examine_unverifiable(claim, &Counts::unsupported_flags, &SourceCounts::unsupported_flags);
  const MessageInfo* info = find_message(claim.frame.message_id, messages_);
  if (info == nullptr) return examine_unverifiable(claim, &Counts::unknown_id, &SourceCounts::unknown_id);
  if (claim.frame.version == 1 && claim.frame.length != info->min_length) return refuse_header();
  if (offset_ < signature_until_ && !continues_a_sender(claim.frame)) return Verdict::kNotAFrame;
  if (available() < claim.total) return Verdict::kNeedMore;
  return check(claim, info->crc_extra);
}

Parser::Verdict Parser::refuse_header() noexcept {
  if (frame_is_due()) ++counts_.bad_header;
  return Verdict::kNotAFrame;
}

bool Parser::checksum_holds(std::size_t at, const Claim& claim, std::uint8_t crc_extra) const noexcept {
  const std::uint8_t* p = buffer_.data() + head_ + at;
  const std::size_t end = claim.header + claim.frame.length;
  const std::uint16_t crc = crc_add(crc_add(kCrcInitial, std::span(p + 1, end - 1)), crc_extra);
  return crc == (p[end] | p[end + 1] << 8);
}

/// How many numbers `frame` is ahead of what its sender used last, `before` included; 0 for a sender not known.
int Parser::steps_ahead(const Frame& frame, const Frame& before) noexcept {
  if (same_sender(frame, before)) return static_cast<std::uint8_t>(frame.sequence - before.sequence);
  const SourceCounts* source = sources_.find(frame.system_id, frame.component_id);
  if (source == nullptr) return 0;
  return static_cast<std::uint8_t>(frame.sequence - source->last_sequence - source->unverified_since_good);
}

/// Inside a signature only a frame that goes on where its sender was is believed, so that random bytes seldom make the
/// next frame wait.
bool Parser::continues_a_sender(const Frame& frame) noexcept {
  constexpr int kNear = 32;
  const SourceCounts* source = sources_.find(frame.system_id, frame.component_id);
  return source != nullptr && static_cast<std::uint8_t>(frame.sequence - source->last_sequence - 1) < kNear;
}

/// True if a good frame inside the claim is not its payload but its neighbour, so that the claimed length is damaged:
/// it ends exactly where the claim ends, or is the next of a sender of whom the frame behind the claim says nothing.
bool Parser::swallows_a_frame(const Claim& claim, const Frame& follower) noexcept {
  constexpr int kNear = 4;
  for (std::size_t at = 1; at + kHeaderV1 + kChecksumBytes <= claim.total; ++at) {
    const std::uint8_t start = buffer_[head_ + at];
    Claim inner;
    if ((start != kStartV1 && start != kStartV2) || !read_header(at, inner) || at + inner.total > claim.total) continue;
    const int ahead = same_sender(inner.frame, follower) ? 0 : steps_ahead(inner.frame, claim.frame);
    if (at + inner.total != claim.total && (ahead == 0 || ahead > kNear)) continue;
    const MessageInfo* info = find_message(inner.frame.message_id, messages_);
    if (info != nullptr && checksum_holds(at, inner, info->crc_extra)) return true;
  }
  return false;
}

/// A frame of unknown id or format. Where none was due it is noise; else it waits for what follows it.
Parser::Verdict Parser::examine_unverifiable(const Claim& claim, std::uint64_t Counts::*total,
                                             std::uint64_t SourceCounts::*row) noexcept {
  if (!frame_is_due()) return Verdict::kNotAFrame;
  Claim follower;
  const bool header_there = read_header(claim.total, follower);
  const bool has_first = available() > claim.total;
  const std::uint8_t first = has_first ? buffer_[head_ + claim.total] : kStartV2;
  const bool plausible_first = first == kStartV1 || first == kStartV2;
  if (plausible_first && !header_there) return Verdict::kNeedMore;
  SourceCounts* source = sources_.find(claim.frame.system_id, claim.frame.component_id);
  ++(counts_.*total);
  if (source != nullptr) {
    ++(source->*row);
    ++source->unverified_since_good;
  }
  due_ = counted_until_ = offset_ + claim.total;
  const bool follows = plausible_first && steps_ahead(follower.frame, claim.frame) == 1;
  return follows && !swallows_a_frame(claim, follower.frame) ? Verdict::kPassOver : Verdict::kNotAFrame;
}

/// The whole frame is there: its checksum decides.
Parser::Verdict Parser::check(Claim& claim, std::uint8_t crc_extra) noexcept {
  const std::span<const std::uint8_t> wire(buffer_.data() + head_, claim.total);
  Frame& f = claim.frame;
  if (!checksum_holds(0, claim, crc_extra)) {
    if (offset_ < counted_until_) return Verdict::kNotAFrame;
    ++counts_.bad_crc;
    if (SourceCounts* source = sources_.find(f.system_id, f.component_id)) ++source->bad_crc;
    due_ = offset_ + claim.total;
    return Verdict::kNotAFrame;
  }
  f.wire = wire;
  f.payload = wire.data() + claim.header;
  if (f.is_signed) f.signature = wire.last(kSignatureBytes);
  if (!admitted(f)) return Verdict::kRefused;
  ++counts_.good;
  counts_.signed_frames += f.is_signed ? 1 : 0;
  counts_.sequence_lost += sources_.add_good(f.system_id, f.component_id, f.sequence, counts_.untracked_sources);
  return Verdict::kGood;
}

bool Parser::admitted(Frame& f) noexcept {
  if (signatures_ == nullptr) return true;
  const SignatureVerdict verdict = signatures_->judge(f);
  f.is_verified = f.is_signed && verdict != SignatureVerdict::kWrong;
  if (!passes(verdict)) ++counts_.refused;
  return passes(verdict);
}

}  // namespace wasp::mavlink
