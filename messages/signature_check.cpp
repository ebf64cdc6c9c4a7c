#include "messages/signature_check.h"

namespace wasp::mavlink {
namespace {

std::uint64_t& count_of(SignatureCounts& counts, SignatureVerdict verdict) WASP_REALTIME {
  switch (verdict) {
    case SignatureVerdict::kVerified:
      return counts.verified;
    case SignatureVerdict::kUnsignedAllowed:
      return counts.unsigned_allowed;
    case SignatureVerdict::kUnsignedRefused:
      return counts.unsigned_refused;
    case SignatureVerdict::kWrong:
      return counts.wrong;
    case SignatureVerdict::kOld:
      return counts.old;
    case SignatureVerdict::kTooLate:
      return counts.too_late;
    case SignatureVerdict::kNoRoom:
      break;
  }
  return counts.no_room;
}

std::uint64_t time_of(std::span<const std::uint8_t> signature) WASP_REALTIME {
  std::uint64_t time = 0;
  for (std::size_t i = 6; i > 0; --i) time = time << 8 | signature[i];
  return time;
}

/// In a time that does not tell where they differ.
bool same_bytes(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) WASP_REALTIME {
  unsigned differences = 0;
  for (std::size_t i = 0; i < a.size(); ++i) differences |= static_cast<unsigned>(a[i] ^ b[i]);
  return differences == 0;
}

}  // namespace

SignatureVerdict SignatureCheck::judge(const Frame& frame) WASP_REALTIME {
  const SignatureVerdict verdict = frame.is_signed ? judge_signed(frame) : judge_unsigned(frame);
  ++count_of(counts_, verdict);
  return verdict;
}

SignatureVerdict SignatureCheck::judge_unsigned(const Frame& frame) const WASP_REALTIME {
  const bool allowed = !required_ || frame.is<RadioStatus>();
  return allowed ? SignatureVerdict::kUnsignedAllowed : SignatureVerdict::kUnsignedRefused;
}

SignatureVerdict SignatureCheck::judge_signed(const Frame& frame) WASP_REALTIME {
  const auto six = signature_of(key_, frame.wire.first(frame.wire.size() - 6));
  if (!same_bytes(six, frame.signature.last(6))) return SignatureVerdict::kWrong;
  return judge_time(frame);
}

/// The signature holds: is it of now?
SignatureVerdict SignatureCheck::judge_time(const Frame& frame) WASP_REALTIME {
  const std::uint64_t time = time_of(frame.signature);
  Stream* stream = find(frame);
  if (stream != nullptr && time <= stream->last) return SignatureVerdict::kOld;
  if (stream == nullptr) {
    if (time + kSigningMinute < clock_.now()) return SignatureVerdict::kTooLate;
    if (used_ == streams_.size()) return SignatureVerdict::kNoRoom;
    stream = &streams_[used_++];
    *stream = {frame.system_id, frame.component_id, frame.signature[0], 0};
  }
  stream->last = time;
  clock_.advance_to(time + 1);
  return SignatureVerdict::kVerified;
}

SignatureCheck::Stream* SignatureCheck::find(const Frame& frame) WASP_REALTIME {
  for (std::size_t i = 0; i < used_; ++i) {
    Stream& s = streams_[i];
    if (s.system_id == frame.system_id && s.component_id == frame.component_id && s.link == frame.signature[0])
      return &s;
  }
  return nullptr;
}

}  // namespace wasp::mavlink
