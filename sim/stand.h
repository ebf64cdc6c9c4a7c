// The rotating platform on which the thesis compared visual and gyro yaw rate (fig. 5.6a): the vehicle is bolted to it,
// level, and turns with it about its own axis.
#pragma once

#include <cstdint>

#include "sim/vehicle.h"

namespace wasp::sim {

enum class StandProfile : std::uint8_t { kSine = 0, kSteps = 1 };

struct StandParams {
  bool turntable = false;
  double height_m = 1;             ///< of the vehicle's centre
  double amplitude_radps = 0.698;  ///< 40 degrees a second
  double period_s = 8;             ///< of the sine; two steps take as long
  StandProfile profile = StandProfile::kSine;
  double start_s = 5;  ///< still before
};

/// Yaw rate [rad/s] `t_s` after the simulator's start. Steps: +1, -1, +2, -2, +3, -3 thirds of the amplitude and again,
/// each reached in 0.2 s.
double stand_yaw_rate_radps(const StandParams& params, double t_s);

/// The vehicle on the platform, 1 ms after `before`.
VehicleState carried(const StandParams& params, const VehicleState& before, double t_s, double gravity_mps2);

}  // namespace wasp::sim
