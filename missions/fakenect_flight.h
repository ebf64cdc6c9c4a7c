// A mission flown in lockstep, what its front camera sees kept as a dump for fakenect, with the truth beside it.
#pragma once

#include <filesystem>

#include "missions/mission_setup.h"
#include "sim/fakenect_dump.h"

namespace wasp::missions {

struct FakenectFlight {
  double from_s = 10, seconds = 5;  ///< which part of the flight
  sim::FakenectOptions dump;
};

/// Flies until the part is over; returns the exposures kept. Beside INDEX.txt it writes truth.csv: exposure (from 0),
/// t_s since the first, height_m of the camera above the world's ground, north_m, east_m, and the attitude. Throws what
/// the flight and the dump throw.
std::uint64_t record_fakenect(const MissionSetup& setup, const FakenectFlight& part,
                              const std::filesystem::path& folder);

}  // namespace wasp::missions
