// A safety pilot's thumbs. wasp's altitude behaviours command a level attitude and say nothing of where the vehicle
// drifts, and the thesis flew supervised: so, unless switched off, somebody adds a small slow roll and pitch, from the
// true position, that holds the vehicle over a point (PD, 0.2 Hz, at most 3 degrees). While more than 1 degree of tilt
// is commanded the pilot lets go, and afterwards holds the place where the vehicle then is.
#pragma once

#include "sim/attitude_controller.h"
#include "sim/vehicle.h"

namespace wasp::sim {

struct PilotTrim {
  float roll_rad = 0, pitch_rad = 0;
};

class SafetyPilot {
 public:
  explicit SafetyPilot(bool enabled) : enabled_(enabled) {}

  /// Trim for now. `active` is false on the ground and while disarmed: no trim, and the next flight starts a new hold.
  PilotTrim step(const VehicleState& truth, const AttitudeSetpoint& commanded, bool active);

 private:
  bool enabled_;
  bool holding_ = false;
  Eigen::Vector2d hold_ned_m_ = Eigen::Vector2d::Zero();
};

}  // namespace wasp::sim
