// What is known of a vehicle that somebody else flies: written by the thread that hears of it, read by the camera's.
// The camera asks for the past: `delay_ns` says how far back a pose is to be had.
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sim/arrival_lag.h"
#include "sim/pose_placement.h"
#include "sim/pose_track.h"

namespace wasp::sim {

struct FollowParams {
  PlacementParams placement;
  DurationNs delay_ns = 0;  ///< 0: as the poses come
};

class FollowedPose {
 public:
  static constexpr DurationNs kLeastDelay = 5 * kMillisecond, kMostDelay = 700 * kMillisecond,
                              kMargin = 3 * kMillisecond, kLeastPatience = 25 * kMillisecond;

  explicit FollowedPose(const FollowParams& params) : params_(params), placement_(params.placement) {}

  void attitude(const AttitudeFix& fix, TimeNs arrived_at_ns);
  void position(const ReportedPosition& reported, TimeNs at_ns, TimeNs arrived_at_ns);
  void armed(bool armed);
  /// Positions come from another message now.
  void source_changed();
  /// The autopilot was started again: its clock and perhaps its place are new.
  void restarted();

  /// Pose at an instant that lies far enough back; nullopt where nobody knows.
  [[nodiscard]] std::optional<BodyPose> at(TimeNs at_ns) const;
  /// How long after an instant its pose can be had as a rule, and a little more.
  [[nodiscard]] DurationNs delay_ns() const;
  /// How much longer it took at the worst of late.
  [[nodiscard]] DurationNs patience_ns() const;
  [[nodiscard]] double attitude_rate_hz(TimeNs now_ns) const;
  [[nodiscard]] double position_rate_hz(TimeNs now_ns) const;

  /// A line for people; taken by whoever prints.
  void say(std::string text);
  std::vector<std::string> take_texts();

 private:
  FollowParams params_;
  mutable std::mutex mutex_;  ///< all below
  PosePlacement placement_;
  PoseTrack track_;
  ArrivalLag attitude_lag_, position_lag_;
  std::vector<std::string> texts_;
};

}  // namespace wasp::sim
