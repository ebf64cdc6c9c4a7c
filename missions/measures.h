// Figures taken from a flight. One function a kind of mission; NaN where the flight does not tell.
#pragma once

#include "missions/judge.h"
#include "tools/report_series.h"

namespace wasp::missions {

/// 1 if the mission came to its end in order and the vehicle was in the air for most of its legs.
double flown_to_its_end(const FlightTrace& trace);

/// Nothing but whether it was flown.
Measures measure_flight(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe);
/// Frames at `rate_hz` until the vehicle, flying on as it does at `truth`, touches something; NaN if nothing is in its
/// way.
double frames_to_impact(const Truth& truth, const WorldProbe& probe, double rate_hz);

Measures measure_hover(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe);
/// Correlation and RMS difference of the visual yaw rate and the gyro's, pair by pair of frames (fig. 5.6).
Measures measure_yaw(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe);
/// How many frames before the impact avoid was raised, had the vehicle flown on (figs 5.9, 5.10).
Measures measure_wall(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe);
/// Collisions, false avoids, way, and lateral swing (figs 6.8, 6.9).
Measures measure_corridor(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe);
/// Does the height follow the edge (fig. 7.19)?
Measures measure_arena(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe);
/// Collisions, height above the obstacles, overshoot (figs 7.20, 7.21, 7.24).
Measures measure_city(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe);
/// Height from edges with lambda unknown (figs 7.8 ... 7.12 in flight).
Measures measure_edge_height(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe);
/// Grazing landing: ventral flow held, low and slow at the end.
Measures measure_landing(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe);
/// Everything at once: who spoke, who was over budget.
Measures measure_all(const FlightTrace& trace, const MissionSetup& setup, WorldProbe& probe);

/// Visual yaw rate of `behaviour` and the gyro's mean over the same interval [rad/s], over seconds since lift-off.
struct YawRates {
  tools::Series visual, gyro;
};
YawRates yaw_rates(const FlightTrace& trace, const std::string& behaviour);

}  // namespace wasp::missions
