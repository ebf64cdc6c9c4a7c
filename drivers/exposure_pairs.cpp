#include "drivers/exposure_pairs.h"

#include <algorithm>
#include <cstdlib>

namespace wasp::drivers {

/// Nearest means within half a period; a little more, so that two sensors just out of step do not fall between.
bool ExposurePairs::belongs(TimeNs gray_at_ns) const noexcept {
  return seen_depth_ && !depth_taken_ && std::abs(gray_at_ns - last_depth_.exposed_at_ns) <= period_ns_ * 11 / 20;
}

/// Periods in a span of time, at least one.
std::uint32_t ExposurePairs::steps(DurationNs ahead_ns) const noexcept {
  return static_cast<std::uint32_t>(std::max<DurationNs>(1, (ahead_ns + period_ns_ / 2) / period_ns_));
}

ExposureStamp ExposurePairs::add_depth(TimeNs exposed_at_ns) noexcept {
  if (seen_depth_ && !depth_taken_) ++counts_.lone_depth;
  std::uint32_t sequence = seen_depth_  ? last_depth_.sequence + steps(exposed_at_ns - last_depth_.exposed_at_ns)
                           : seen_gray_ ? last_gray_.sequence + steps(exposed_at_ns - last_gray_at_ns_)
                                        : 0;
  seen_depth_ = true;
  depth_taken_ = false;
  last_depth_ = {exposed_at_ns, sequence};
  return last_depth_;
}

std::optional<ExposureStamp> ExposurePairs::add_gray(TimeNs exposed_at_ns) noexcept {
  if (belongs(exposed_at_ns)) return join(exposed_at_ns);
  constexpr int kStillComing = 3;  // periods after which a silent depth sensor is waited for no longer
  const bool coming = depth_ && (!seen_depth_ || exposed_at_ns - last_depth_.exposed_at_ns < kStillComing * period_ns_);
  if (!coming) return alone(exposed_at_ns);
  waiting_ = true;
  waiting_at_ns_ = exposed_at_ns;
  return std::nullopt;
}

std::optional<ExposureStamp> ExposurePairs::take_waiting() noexcept {
  if (!waiting_) return std::nullopt;
  waiting_ = false;
  return belongs(waiting_at_ns_) ? join(waiting_at_ns_) : alone(waiting_at_ns_);
}

ExposureStamp ExposurePairs::join(TimeNs gray_at_ns) noexcept {
  ++counts_.pairs;
  counts_.skew_sum_ns += gray_at_ns - last_depth_.exposed_at_ns;
  depth_taken_ = seen_gray_ = true;
  last_gray_at_ns_ = gray_at_ns;
  last_gray_ = last_depth_;
  return last_gray_;
}

ExposureStamp ExposurePairs::alone(TimeNs gray_at_ns) noexcept {
  if (depth_) ++counts_.lone_gray;
  std::uint32_t sequence = seen_gray_ ? last_gray_.sequence + steps(gray_at_ns - last_gray_at_ns_) : 0;
  if (seen_depth_ && gray_at_ns > last_depth_.exposed_at_ns)
    sequence = std::max(sequence, last_depth_.sequence + steps(gray_at_ns - last_depth_.exposed_at_ns));
  seen_gray_ = true;
  last_gray_at_ns_ = gray_at_ns;
  last_gray_ = {gray_at_ns, sequence};
  return last_gray_;
}

}  // namespace wasp::drivers
