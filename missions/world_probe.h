// Asks the world of a mission for distances: how near the vehicle came to anything, and what lies below it.
#pragma once

#include <memory>

#include "missions/flight_trace.h"
#include "missions/mission_setup.h"

namespace wasp::missions {

class WorldProbe {
 public:
  /// Builds the mission's world for its seed.
  explicit WorldProbe(const MissionSetup& setup);
  ~WorldProbe();

  /// What is around the vehicle `flight_time_s` after lift-off.
  struct Look {
    double around_m = 0;  ///< nearest surface that is not the ground below [m], at most kRange_m
    double below_m = 0;   ///< from the vehicle down to what is under it
  };
  Look look(const Truth& truth, double flight_time_s);

  static constexpr double kRange_m = 3.0;
  static constexpr double kBodyRadius_m = 0.30;  ///< nearer than this is a collision

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace wasp::missions
