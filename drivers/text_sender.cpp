#include "drivers/text_sender.h"

#include <algorithm>

namespace wasp::drivers {
namespace {

std::uint64_t hash_of(std::uint8_t severity, std::string_view text) noexcept {
  std::uint64_t hash = 14695981039346656037ull ^ severity;  // FNV-1a
  for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211ull;
  return hash;
}

/// At most `most` bytes, ending with a whole UTF-8 character.
std::size_t whole_characters(std::string_view text, std::size_t most) noexcept {
  if (text.size() <= most) return text.size();
  std::size_t n = most;
  while (n > 0 && (static_cast<std::uint8_t>(text[n]) & 0xc0u) == 0x80u) --n;
  return n == 0 ? most : n;
}

}  // namespace

bool TextSender::offer(std::uint8_t severity, std::string_view text, TimeNs now_ns) WASP_REALTIME {
  text = {text.data(), std::min(text.find('\0'), text.size())};
  text = {text.data(), whole_characters(text, kLongest)};
  if (text.empty()) return false;
  const std::uint64_t hash = hash_of(severity, text);
  const bool repeats = std::any_of(said_.begin(), said_.end(), [&](const Said& s) noexcept {
    return s.at_ns != kNever && s.hash == hash && now_ns - s.at_ns < kSame;
  });
  if (repeats || count_ == kWaiting) {
    ++dropped_;
    return false;
  }
  said_[next_said_++ % said_.size()] = {hash, now_ns};
  Text& slot = texts_[(head_ + count_++) % kWaiting];
  slot = {};
  slot.severity = severity;
  slot.size = text.size();
  std::copy(text.begin(), text.end(), slot.bytes.begin());
  if (text.size() <= kChunk) return true;
  slot.id = next_id_;
  next_id_ = static_cast<std::uint16_t>(next_id_ == 65535 ? 1 : next_id_ + 1);
  return true;
}

bool TextSender::may_begin(TimeNs now_ns) const WASP_REALTIME { return free_at_ns_ == kNever || now_ns >= free_at_ns_; }

bool TextSender::due(TimeNs now_ns) const WASP_REALTIME {
  return count_ > 0 && (texts_[head_].sent > 0 || may_begin(now_ns));
}

mavlink::Statustext TextSender::take(TimeNs now_ns) WASP_REALTIME {
  Text& text = texts_[head_];
  if (text.sent == 0) {
    const TimeNs full_since_ns = now_ns - (kBurst - 1) * kRefill;
    free_at_ns_ = (free_at_ns_ == kNever ? full_since_ns : std::max(free_at_ns_, full_since_ns)) + kRefill;
  }
  mavlink::Statustext m;
  m.severity = text.severity;
  m.id = text.id;
  m.chunk_seq = text.chunk++;
  // Not cut at characters: the receiver puts the bytes together before it reads them. The last chunk is never full, so
  // that a NUL ends the text.
  const std::size_t n = std::min(text.size - text.sent, kChunk);
  std::copy_n(text.bytes.begin() + static_cast<std::ptrdiff_t>(text.sent), n, m.text.begin());
  text.sent += n;
  const bool ended = text.sent == text.size && (text.id == 0 || n < kChunk);
  if (ended) {
    head_ = (head_ + 1) % kWaiting;
    --count_;
  }
  return m;
}

}  // namespace wasp::drivers
