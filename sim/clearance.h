// How far the vehicle's centre is from the nearest surface of the world, exactly: Embree's point query finds the
// nearest point of every face within reach, in a few microseconds. (Rays in fixed directions would slip past table legs
// and corners.)
#pragma once

#include <memory>

#include "sim/world_scene.h"

namespace wasp::sim {

/// Arm and half a propeller, 0.185 m + 0.254 m / 2: the vehicle is taken for a ball of this radius.
inline constexpr float kBodyRadius_m = 0.31f;
inline constexpr float kClearanceRange_m = 3.f;

/// Distances [m] from the centre; kClearanceRange_m where nothing is nearer.
struct Clearance {
  float below_m = kClearanceRange_m;   ///< to faces whose nearest point is within 45 degrees of straight down: the
                                       ///< floor, or a roof. The legs are 0.20 m long, so a landing comes this near.
  float around_m = kClearanceRange_m;  ///< to all other faces

  /// Touches something it does not stand or land on.
  [[nodiscard]] bool collides() const { return around_m < kBodyRadius_m; }
  /// The same in flight, when it must not touch what is below either.
  [[nodiscard]] bool collides_in_flight() const { return collides() || below_m < kBodyRadius_m; }
};

/// At this place and flight time (Simulator::flight_time_s). Allocates nothing. Any thread.
Clearance clearance_at(const WorldScene& scene, const Vec3& centre_ned_m, double flight_time_s);

}  // namespace wasp::sim
