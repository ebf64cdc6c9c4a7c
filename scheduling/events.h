// Short texts from real-time threads to the log: queued without waiting, printed by the main thread.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "rt/spsc_queue.h"
#include "types/time.h"

namespace wasp::scheduling {

struct Event {
  TimeNs at_ns = 0;
  std::array<char, 120> text{};
};

/// One producer (a real-time thread), one consumer (the main thread). A full queue drops the event and counts it.
class EventQueue {
 public:
  /// Realtime-safe: yes.
  void say(TimeNs at_ns, std::string_view head, std::string_view tail = {}) WASP_REALTIME {
    Event e;
    e.at_ns = at_ns;
    const std::size_t n = std::min(head.size(), e.text.size() - 1);
    std::memcpy(e.text.data(), head.data(), n);
    std::memcpy(e.text.data() + n, tail.data(), std::min(tail.size(), e.text.size() - 1 - n));
    if (!queue_.push(e)) ++dropped_;
  }
  /// With a number behind the text. Realtime-safe: yes.
  void say(TimeNs at_ns, std::string_view head, long number) WASP_REALTIME {
    std::array<char, 24> digits;
    char* const end = digits.data() + digits.size();
    char* begin = end;
    unsigned long rest = number < 0 ? 0ul - static_cast<unsigned long>(number) : static_cast<unsigned long>(number);
    for (; begin == end || rest != 0; rest /= 10) *--begin = static_cast<char>('0' + rest % 10);
    if (number < 0) *--begin = '-';
    say(at_ns, head, std::string_view(begin, static_cast<std::size_t>(end - begin)));
  }
  bool take(Event& e) noexcept { return queue_.pop(e); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  rt::SpscQueue<Event, 64> queue_;
  std::uint64_t dropped_ = 0;
};

}  // namespace wasp::scheduling
