#include "drivers/device_clock.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace wasp::drivers {
namespace {

constexpr std::int64_t kWrap = std::int64_t{1} << 32;

}  // namespace

/// The value congruent to `ticks` that lies nearest to the last one, moved on by the time that passed since: a stream
/// that was silent for minutes is unwrapped right as well.
std::int64_t DeviceClock::unwrap(std::uint32_t ticks) const noexcept {
  const auto difference = static_cast<std::int32_t>(ticks - static_cast<std::uint32_t>(last_ticks_));
  return last_ticks_ + difference;
}

DurationNs DeviceClock::device_ns(std::int64_t ticks) const noexcept {
  return static_cast<DurationNs>(std::llround(static_cast<double>(ticks - origin_ticks_) * ns_per_tick_));
}

DurationNs DeviceClock::line_at(DurationNs device_ns) const noexcept {
  return anchor_.offset_ns +
         static_cast<DurationNs>(slope_ * static_cast<double>(device_ns - anchor_.device_ns));
}

void DeviceClock::start(std::int64_t ticks, TimeNs arrived_at_ns) noexcept {
  started_ = true;
  origin_ticks_ = last_ticks_ = ticks;
  last_arrival_ns_ = arrived_at_ns;
  filled_ = doubts_ = set_aside_ = 0;
  slope_ = 0;
  anchor_ = {0, arrived_at_ns};
  keep(anchor_);
}

bool DeviceClock::add(std::uint32_t ticks, TimeNs arrived_at_ns) noexcept {
  if (!started_) return start(ticks, arrived_at_ns), true;
  const double silent_ticks = static_cast<double>(arrived_at_ns - last_arrival_ns_) / ns_per_tick_;
  const auto wraps = static_cast<std::int64_t>(
      std::llround((silent_ticks - static_cast<double>(unwrap(ticks) - last_ticks_)) / static_cast<double>(kWrap)));
  const std::int64_t unwrapped = unwrap(ticks) + wraps * kWrap;
  const Point point{device_ns(unwrapped), arrived_at_ns - device_ns(unwrapped)};
  const DurationNs above_ns = point.offset_ns - line_at(point.device_ns);
  if (above_ns < -kEarlyNs || above_ns > kLateNs) return doubt(point, unwrapped, arrived_at_ns);
  doubts_ = set_aside_ = 0;
  last_ticks_ = std::max(last_ticks_, unwrapped);
  last_arrival_ns_ = arrived_at_ns;
  keep(point);
  return true;
}

bool DeviceClock::doubt(const Point& point, std::int64_t ticks, TimeNs arrived_at_ns) noexcept {
  if (doubts_ == 0 || std::abs(point.offset_ns - doubted_offset_ns_) > kEarlyNs) {
    doubts_ = 0;
    doubted_offset_ns_ = point.offset_ns;
  }
  if (++doubts_ < kJumpAfter && ++set_aside_ < kLostAfter) return false;
  start(ticks, arrived_at_ns);
  ++jumps_;
  return true;
}

void DeviceClock::keep(const Point& point) noexcept {
  const DurationNs bucket = point.device_ns / kBucketNs;
  Point* newest = filled_ > 0 ? &least_[static_cast<std::size_t>(filled_ - 1)] : nullptr;
  if (newest != nullptr && bucket <= newest->device_ns / kBucketNs) {
    if (point.offset_ns >= newest->offset_ns || bucket < newest->device_ns / kBucketNs) return;
    *newest = point;
  } else {
    if (filled_ == kBuckets) std::move(least_.begin() + 1, least_.end(), least_.begin());
    filled_ = std::min(filled_ + 1, kBuckets);
    least_[static_cast<std::size_t>(filled_ - 1)] = point;
  }
  fit();
}

/// Andrew's monotone chain, lower half; the number of its corners.
int DeviceClock::lower_hull(std::array<Point, kBuckets>& hull) const noexcept {
  int n = 0;
  for (int i = 0; i < filled_; ++i) {
    const Point& p = least_[static_cast<std::size_t>(i)];
    const auto above_chord = [&p](const Point& a, const Point& b) {
      return static_cast<double>(b.offset_ns - a.offset_ns) * static_cast<double>(p.device_ns - a.device_ns) >=
             static_cast<double>(p.offset_ns - a.offset_ns) * static_cast<double>(b.device_ns - a.device_ns);
    };
    while (n >= 2 && above_chord(hull[static_cast<std::size_t>(n - 2)], hull[static_cast<std::size_t>(n - 1)])) --n;
    hull[static_cast<std::size_t>(n++)] = p;
  }
  return n;
}

void DeviceClock::fit() noexcept {
  std::array<Point, kBuckets> hull;
  const int corners = lower_hull(hull);
  double mean_ns = 0;
  for (int i = 0; i < filled_; ++i)
    mean_ns += static_cast<double>(least_[static_cast<std::size_t>(i)].device_ns) / filled_;
  int right = 1;
  while (right < corners - 1 && static_cast<double>(hull[static_cast<std::size_t>(right)].device_ns) < mean_ns) ++right;
  const Point& a = hull[static_cast<std::size_t>(std::max(0, std::min(right, corners - 1) - 1))];
  anchor_ = a;
  slope_ = 0;
  if (corners < 2) return;
  const Point& b = hull[static_cast<std::size_t>(right)];
  const double slope =
      static_cast<double>(b.offset_ns - a.offset_ns) / static_cast<double>(b.device_ns - a.device_ns);
  // A few seconds tell an offset but no drift: what is left of one bucket's jitter would be taken for it.
  if (filled_ >= 8) slope_ = std::clamp(slope, -kMaxDrift, kMaxDrift);
  // Under a line with another slope than the edge's the points must still not lie.
  DurationNs under_ns = 0;
  for (int i = 0; i < filled_; ++i) {
    const Point& p = least_[static_cast<std::size_t>(i)];
    under_ns = std::min(under_ns, p.offset_ns - line_at(p.device_ns));
  }
  anchor_.offset_ns += under_ns;
}

TimeNs DeviceClock::to_local(std::uint32_t ticks) const noexcept {
  const DurationNs at_ns = device_ns(unwrap(ticks));
  return at_ns + line_at(at_ns);
}

}  // namespace wasp::drivers
