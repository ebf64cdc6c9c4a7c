// When a sample of the autopilot was true, on our clock. TIMESYNC's map decides where it is credible. A lockstep
// simulator's clock may run faster or slower than real time, or stand still now and then; no offset fits it, and its
// samples are dated by their arrival.
#pragma once

#include <algorithm>

#include "drivers/clock_map.h"
#include "types/time.h"

namespace wasp::sim {

class SampleDating {
 public:
  static constexpr DurationNs kOldest = 300 * kMillisecond, kEarly = 5 * kMillisecond;
  static constexpr DurationNs kWindow = 4 * kSecond;
  static constexpr double kRealTime = 0.01;  ///< a clock that gains or loses more is not one

  enum class News : std::uint8_t { kNone, kRestarted, kNotRealTime, kRealTime };

  /// Takes notice of a remote time; kRestarted: it went back, all that was known of it is void.
  News note(TimeNs remote_ns, TimeNs arrived_at_ns) {
    if (first_local_ns_ != kNever && remote_ns < last_remote_ns_ - kSecond) {
      *this = {};
      begin(remote_ns, arrived_at_ns);
      return News::kRestarted;
    }
    last_remote_ns_ = std::max(last_remote_ns_, remote_ns);
    if (first_local_ns_ == kNever) begin(remote_ns, arrived_at_ns);
    if (arrived_at_ns - first_local_ns_ < kWindow) return News::kNone;
    rate_ = static_cast<double>(remote_ns - first_remote_ns_) / static_cast<double>(arrived_at_ns - first_local_ns_);
    begin(remote_ns, arrived_at_ns);
    const bool real = std::abs(rate_ - 1) <= kRealTime, was = real_time_;
    real_time_ = real;
    return real == was ? News::kNone : real ? News::kRealTime : News::kNotRealTime;
  }
  /// Never after its arrival.
  [[nodiscard]] TimeNs date(TimeNs remote_ns, TimeNs arrived_at_ns, const drivers::ClockMap& clock) const {
    if (!real_time_ || !clock.synced() || remote_ns < 0) return arrived_at_ns;
    const TimeNs at_ns = clock.to_local(remote_ns);
    const bool credible = at_ns <= arrived_at_ns + kEarly && at_ns >= arrived_at_ns - kOldest;
    return credible ? std::min(at_ns, arrived_at_ns) : arrived_at_ns;
  }
  /// Seconds of theirs in a second of ours, over the last window.
  [[nodiscard]] double rate() const { return rate_; }
  [[nodiscard]] bool real_time() const { return real_time_; }

 private:
  void begin(TimeNs remote_ns, TimeNs arrived_at_ns) {
    first_remote_ns_ = last_remote_ns_ = remote_ns;
    first_local_ns_ = arrived_at_ns;
  }
  TimeNs first_remote_ns_ = 0, last_remote_ns_ = 0, first_local_ns_ = kNever;
  double rate_ = 1;
  bool real_time_ = true;
};

}  // namespace wasp::sim
