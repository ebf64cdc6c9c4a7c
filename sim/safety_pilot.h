// A safety pilot's thumbs. wasp's altitude behaviours command a level attitude and say nothing of where the vehicle
// drifts, and the thesis flew supervised: so, unless switched off, somebody adds a small slow roll and pitch, from the
// true position, that holds the vehicle over a point (PD, 0.2 Hz, at most 3 degrees). While more than 1 degree of tilt
// is commanded the pilot lets go, and afterwards holds the place where the vehicle then is.
//
// For flights over obstacles "the UAV autopilot maintained a constant heading and forward speed" (thesis 7.4.2): the
// held point then moves north, with up to 12 degrees of tilt, and the heading is held by a yaw rate.
#pragma once

#include "sim/attitude_controller.h"
#include "sim/vehicle.h"

namespace wasp::sim {

struct PilotTrim {
  float roll_rad = 0, pitch_rad = 0, yaw_rate_radps = 0;
};

struct PilotParams {
  double cruise_mps = 0;         ///< 0: the point stays; else it moves north once the vehicle was above 0.4 m for 2 s
  double cruise_distance_m = 0;  ///< the point's way; 0: no end
  bool hold_heading = false;     ///< adds a yaw rate towards the heading of the take-off
};

class SafetyPilot {
 public:
  explicit SafetyPilot(bool enabled, const PilotParams& params = {}) : enabled_(enabled), params_(params) {}

  /// Trim for now, every 5 ms. `active` is false on the ground and while disarmed: no trim, and the next flight
  /// starts a new hold.
  PilotTrim step(const VehicleState& truth, const AttitudeSetpoint& commanded, bool active);

 private:
  void watch_height(double height_m);
  void move_point();
  [[nodiscard]] PilotTrim hold(const VehicleState& truth) const;
  [[nodiscard]] float heading_rate(double yaw_rad) const;

  bool enabled_;
  PilotParams params_;
  bool flying_ = false, holding_ = false, cruising_ = false;
  Eigen::Vector2d hold_ned_m_ = Eigen::Vector2d::Zero();
  double hold_yaw_rad_ = 0, point_mps_ = 0, way_m_ = 0, high_for_s_ = 0;
};

}  // namespace wasp::sim
