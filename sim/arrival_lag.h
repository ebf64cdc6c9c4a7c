// How long one must wait after an instant until a stream has a sample beyond it: the age that the sample before has
// when the next one arrives, at its worst over the last two to four seconds. Long pauses are no rhythm and do not
// count.
#pragma once

#include <algorithm>

#include "types/time.h"

namespace wasp::sim {

class ArrivalLag {
 public:
  static constexpr DurationNs kBucket = 2 * kSecond, kPause = 600 * kMillisecond;

  void add(TimeNs at_ns, TimeNs arrived_at_ns) {
    if (last_at_ns_ != kNever && arrived_at_ns - last_arrived_ns_ <= kPause) {
      const DurationNs lag_ns = arrived_at_ns - last_at_ns_;
      worst_now_ns_ = std::max(worst_now_ns_, lag_ns);
      mean_ns_ += (lag_ns - mean_ns_) / (mean_ns_ == 0 ? 1 : 16);
    }
    last_at_ns_ = at_ns;
    last_arrived_ns_ = arrived_at_ns;
    ++count_;
    if (bucket_at_ns_ == kNever) bucket_at_ns_ = arrived_at_ns;
    const DurationNs since_ns = arrived_at_ns - bucket_at_ns_;
    if (since_ns < kBucket) return;
    rate_hz_ = static_cast<double>(count_) / to_seconds(since_ns);
    worst_before_ns_ = worst_now_ns_;
    worst_now_ns_ = 0;
    count_ = 0;
    bucket_at_ns_ = arrived_at_ns;
  }
  [[nodiscard]] DurationNs usual_ns() const { return mean_ns_; }
  [[nodiscard]] DurationNs worst_ns() const { return std::max(worst_now_ns_, worst_before_ns_); }
  /// Over the last bucket; 0 in the first, and while nothing comes.
  [[nodiscard]] double rate_hz(TimeNs now_ns) const {
    return last_arrived_ns_ != kNever && now_ns - last_arrived_ns_ <= kPause ? rate_hz_ : 0;
  }

 private:
  TimeNs last_at_ns_ = kNever, last_arrived_ns_ = kNever, bucket_at_ns_ = kNever;
  DurationNs mean_ns_ = 0, worst_now_ns_ = 0, worst_before_ns_ = 0;
  std::uint64_t count_ = 0;
  double rate_hz_ = 0;
};

}  // namespace wasp::sim
