// A camera's own counter (32 bits, some MHz, wrapping) to CLOCK_MONOTONIC from nothing but when its stamps arrive.
// Arrival is late by a least delay and a random one on top, never early, so the map is the line under all points
// (stamp, arrival - stamp): the least of each second is kept for half a minute, and of all lines that no point lies
// under, the one nearest to the points on average is taken: the edge of their lower hull above their mean. A stamp far
// off the line is set aside; when several agree with each other the counter has jumped, and the map starts anew; so it
// does when none was believed for long (a player that falls behind the time of its recording, as fakenect does).
// Pure arithmetic: instants come in as arguments.
#pragma once

#include <array>
#include <cstdint>

#include "types/realtime.h"
#include "types/time.h"

namespace wasp::drivers {

/// Realtime-safe: yes, all of it. One thread.
class DeviceClock {
 public:
  static constexpr DurationNs kBucketNs = kSecond;
  static constexpr int kBuckets = 32;
  static constexpr double kMaxDrift = 300e-6;                 ///< crystals are within 100 ppm
  static constexpr DurationNs kEarlyNs = 20 * kMillisecond;   ///< further under the line is no arrival of this clock
  static constexpr DurationNs kLateNs = 250 * kMillisecond;   ///< further above is not this clock either
  static constexpr int kJumpAfter = 5;                        ///< stamps set aside that agree with each other
  static constexpr int kLostAfter = 90;                       ///< set aside in a row, whether they agree or not

  explicit DeviceClock(double ticks_per_s) : ns_per_tick_(1e9 / ticks_per_s) {}

  /// One stamp and when it arrived. False: it lies off and was set aside.
  bool add(std::uint32_t ticks, TimeNs arrived_at_ns) WASP_REALTIME;
  /// Our time of a stamp within half a wrap of the last one added; less the least delay there is no way to know.
  /// Meaningful after the first add.
  [[nodiscard]] TimeNs to_local(std::uint32_t ticks) const WASP_REALTIME;

  [[nodiscard]] double drift() const noexcept { return slope_; }  ///< our seconds per second of theirs, minus 1
  [[nodiscard]] int jumps() const noexcept { return jumps_; }

 private:
  struct Point {
    DurationNs device_ns = 0, offset_ns = 0;  ///< since start; arrival minus device
  };

  [[nodiscard]] std::int64_t unwrap(std::uint32_t ticks) const WASP_REALTIME;
  [[nodiscard]] DurationNs device_ns(std::int64_t ticks) const WASP_REALTIME;
  [[nodiscard]] DurationNs line_at(DurationNs device_ns) const WASP_REALTIME;
  void start(std::int64_t ticks, TimeNs arrived_at_ns) WASP_REALTIME;
  bool doubt(const Point& point, std::int64_t ticks, TimeNs arrived_at_ns) WASP_REALTIME;
  void keep(const Point& point) WASP_REALTIME;
  void fit() WASP_REALTIME;
  int lower_hull(std::array<Point, kBuckets>& hull) const WASP_REALTIME;

  double ns_per_tick_;
  bool started_ = false;
  std::int64_t origin_ticks_ = 0, last_ticks_ = 0;  ///< unwrapped
  TimeNs last_arrival_ns_ = 0;
  std::array<Point, kBuckets> least_{};  ///< of each bucket, oldest first
  int filled_ = 0;
  Point anchor_;  ///< the line goes through it
  double slope_ = 0;
  int doubts_ = 0, set_aside_ = 0, jumps_ = 0;
  DurationNs doubted_offset_ns_ = 0;
};

}  // namespace wasp::drivers
