// Depth and grey images of two sensors that are not in step, made into exposures: an image and the nearest of the other
// kind, at most half a period away, are one. A depth image goes out at once. A grey image goes with the depth image
// before it, or waits for the one to come; alone it goes when that does not come. Images of one exposure carry one
// stamp, the depth image's: readers find the depth of a grey frame by it (scheduling/frame_source.h).
// Pure arithmetic: instants come in as arguments.
#pragma once

#include <cstdint>
#include <optional>

#include "types/realtime.h"
#include "types/time.h"

namespace wasp::drivers {

struct ExposureStamp {
  TimeNs exposed_at_ns = 0;
  std::uint32_t sequence = 0;  ///< on the grid of the period: a gap is a frame that was lost
};

/// Counts since construction.
struct PairCounts {
  std::uint64_t pairs = 0, lone_depth = 0, lone_gray = 0;
  std::int64_t skew_sum_ns = 0;  ///< grey after its depth, over all pairs
};

/// Realtime-safe: yes, all of it. One thread.
class ExposurePairs {
 public:
  /// `depth`: that kind comes at all.
  ExposurePairs(DurationNs period_ns, bool depth) : period_ns_(period_ns), depth_(depth) {}

  /// A depth image came: its stamp. A grey image that waits is taken before it is published (alone), or, if it
  /// waits_for_newest(), after.
  ExposureStamp add_depth(TimeNs exposed_at_ns) WASP_REALTIME;
  /// A grey image came (take_waiting() first): the stamp to publish it with, or none: it has to wait.
  std::optional<ExposureStamp> add_gray(TimeNs exposed_at_ns) WASP_REALTIME;
  [[nodiscard]] bool waiting() const noexcept { return waiting_; }
  /// One waits, and the newest depth image is its own.
  [[nodiscard]] bool waits_for_newest() const WASP_REALTIME { return waiting_ && belongs(waiting_at_ns_); }
  /// The waiting grey image's stamp: with the newest depth image if that is its own, else alone. None if none waits.
  std::optional<ExposureStamp> take_waiting() WASP_REALTIME;

  [[nodiscard]] const PairCounts& counts() const noexcept { return counts_; }

 private:
  [[nodiscard]] bool belongs(TimeNs gray_at_ns) const WASP_REALTIME;
  [[nodiscard]] std::uint32_t steps(DurationNs ahead_ns) const WASP_REALTIME;
  ExposureStamp join(TimeNs gray_at_ns) WASP_REALTIME;
  ExposureStamp alone(TimeNs gray_at_ns) WASP_REALTIME;

  DurationNs period_ns_;
  bool depth_, seen_depth_ = false, seen_gray_ = false;
  bool depth_taken_ = true;  ///< the newest depth image has its grey one
  ExposureStamp last_depth_, last_gray_;
  TimeNs last_gray_at_ns_ = 0, waiting_at_ns_ = 0;
  bool waiting_ = false;
  PairCounts counts_;
};

}  // namespace wasp::drivers
