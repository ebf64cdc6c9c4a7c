// The instants of a counter's stamps on one line of time: differences by the counter where it can be believed, by arrival
// where it jumped. Only differences mean anything: what is whose neighbour, and how many were lost between.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "types/realtime.h"
#include "types/time.h"

namespace wasp::drivers {

/// Realtime-safe: yes. One thread. Stamps may go back a little: two streams share the counter.
class StampTime {
 public:
  /// Further from what the arrivals say, a step is the counter's jump or a wrap missed in silence.
  static constexpr DurationNs kBelievedNs = kSecond;

  explicit StampTime(double ticks_per_s) : ns_per_tick_(1e9 / ticks_per_s) {}

  TimeNs at(std::uint32_t ticks, TimeNs arrived_at_ns) WASP_REALTIME {
    if (!started_) {
      started_ = true;
      time_ns_ = arrived_at_ns;
    } else {
      const auto ahead = static_cast<std::int32_t>(ticks - last_ticks_);
      const auto by_counter = static_cast<DurationNs>(std::llround(ahead * ns_per_tick_));
      const DurationNs by_arrival = arrived_at_ns - last_arrival_ns_;
      time_ns_ += std::llabs(by_counter - by_arrival) > kBelievedNs ? by_arrival : by_counter;
    }
    last_ticks_ = ticks;
    last_arrival_ns_ = arrived_at_ns;
    return time_ns_;
  }

 private:
  double ns_per_tick_;
  bool started_ = false;
  std::uint32_t last_ticks_ = 0;
  TimeNs last_arrival_ns_ = 0, time_ns_ = 0;
};

}  // namespace wasp::drivers
