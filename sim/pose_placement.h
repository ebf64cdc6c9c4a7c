// Where a vehicle that somebody else flies stands in our world. Its own frame has any origin, any height of it, and it
// starts looking anywhere; ours has the start place at the origin, on the ground, facing north. So: until it is armed
// for the first time it stands at the start, whatever its estimator drifts to; what it has then is the origin; from
// there on it moves as it says. One that is armed already when it is first heard flies: its own zero is then taken for
// its start. Another source of positions is joined on where the last one was left. One that was started again and is
// not where it was stands at the start once more.
#pragma once

#include <optional>

#include "sim/pose_track.h"

namespace wasp::sim {

/// As the autopilot says it.
struct ReportedPosition {
  Eigen::Vector3d position_ned_m = Eigen::Vector3d::Zero();
  Vec3 velocity_ned_mps = Vec3::Zero();
};

struct PlacementParams {
  float standing_m = 0.2f;           ///< height of the vehicle's centre when it stands
  bool keep_heading = false;         ///< false: what it faces at the start becomes the world's north
  std::optional<Vec3> origin_ned_m;  ///< given: of the autopilot's frame, the point on the ground below the start
};

class PosePlacement {
 public:
  explicit PosePlacement(const PlacementParams& params) : params_(params) {}

  /// Tells which; unknown (no heartbeat yet) counts as not armed.
  void armed(bool armed);
  /// Positions come in another frame from now on.
  void source_changed() { joining_ = placed_; }
  /// The autopilot was started again, disarmed.
  void restarted() {
    restarted_ = placed_;
    armed_ = false;
  }
  /// Turned into the world. The heading is that of the newest attitude.
  PositionFix place(const ReportedPosition& reported, TimeNs at_ns);
  AttitudeFix place(const AttitudeFix& reported);

  [[nodiscard]] bool flown() const { return armed_once_; }  ///< armed at least once
  /// Time since the vehicle first left the ground; 0 before.
  [[nodiscard]] double flight_time_s(TimeNs at_ns) const {
    return left_ground_at_ns_ == kNever || at_ns < left_ground_at_ns_ ? 0 : to_seconds(at_ns - left_ground_at_ns_);
  }

 private:
  [[nodiscard]] Vec3 in_world(const Eigen::Vector3d& position_ned_m) const;
  void join(const ReportedPosition& reported);
  void find_origin(const ReportedPosition& reported);

  PlacementParams params_;
  Quat q_world_ned_ = Quat::Identity();                     ///< about the vertical
  Eigen::Vector3d origin_ned_m_ = Eigen::Vector3d::Zero();  ///< of the autopilot's frame: the point below the start
  bool placed_ = false, armed_ = false, armed_once_ = false, joining_ = false, restarted_ = false;
  float heading_rad_ = 0;
  Vec3 last_world_m_ = Vec3::Zero();
  Eigen::Vector3d last_reported_m_ = Eigen::Vector3d::Zero();
  TimeNs left_ground_at_ns_ = kNever;
};

}  // namespace wasp::sim
