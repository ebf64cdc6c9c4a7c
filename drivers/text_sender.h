// STATUSTEXT, rate-limited: a ground station shows each one, some speak them. A text waits in a short queue; what
// repeats a text of the last seconds is dropped, and so is what finds no room. Longer than 50 bytes goes out in chunks
// of one id. One thread. Realtime-safe: yes.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "messages/mavlink_messages.h"
#include "rt/contract.h"
#include "types/time.h"

namespace wasp::drivers {

class TextSender {
 public:
  static constexpr std::size_t kLongest = 150, kChunk = 50, kWaiting = 8;
  static constexpr int kBurst = 6;
  static constexpr DurationNs kRefill = 500 * kMillisecond, kSame = 5 * kSecond;

  /// Texts longer than kLongest are cut, in front of a broken UTF-8 sequence. False: dropped.
  bool offer(std::uint8_t severity, std::string_view text, TimeNs now_ns) WASP_REALTIME;
  /// True if a chunk may go out now.
  [[nodiscard]] bool due(TimeNs now_ns) const WASP_REALTIME;
  /// The next chunk; only when due. What was taken counts as sent.
  mavlink::Statustext take(TimeNs now_ns) WASP_REALTIME;
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  struct Text {
    std::uint8_t severity = 6;
    std::array<char, kLongest> bytes{};
    std::size_t size = 0, sent = 0;
    std::uint16_t id = 0;
    std::uint8_t chunk = 0;
  };
  struct Said {
    std::uint64_t hash = 0;
    TimeNs at_ns = kNever;
  };
  [[nodiscard]] bool may_begin(TimeNs now_ns) const WASP_REALTIME;

  std::array<Text, kWaiting> texts_{};
  std::size_t head_ = 0, count_ = 0;
  std::array<Said, 16> said_{};
  std::size_t next_said_ = 0;
  std::uint16_t next_id_ = 1;
  /// Token bucket of whole texts: when the next one is free; at most kBurst refills in the past.
  TimeNs free_at_ns_ = kNever;
  std::uint64_t dropped_ = 0;
};

}  // namespace wasp::drivers
