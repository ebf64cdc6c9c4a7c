// Asks the world of a mission for distances: how near the vehicle came to anything, and what lies below it.
#pragma once

#include <memory>

#include "missions/flight_trace.h"
#include "missions/mission_setup.h"
#include "types/frames.h"

namespace wasp::missions {

class WorldProbe {
 public:
  /// Builds the mission's world for its seed.
  explicit WorldProbe(const MissionSetup& setup);
  ~WorldProbe();

  /// Where the vehicle is in the world's own frame, in which a corridor runs north along y = 0; the flight's frame
  /// begins at the start [m].
  [[nodiscard]] Vec3 in_world(const Truth& truth) const;

  /// What is around the vehicle's centre (sim/clearance.h), people and all as they were then.
  struct Look {
    double around_m = 0, below_m = 0;  ///< nearest surface beside or above, and below; at most 3 m
    bool collides = false;             ///< with something it does not stand or land on
    bool collides_in_flight = false;   ///< or with what is below
  };
  [[nodiscard]] Look look(const Truth& truth) const;
  /// From the vehicle's centre straight down to the ground or a roof [m]; 0 where there is nothing.
  [[nodiscard]] double height_over(const Truth& truth) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace wasp::missions
