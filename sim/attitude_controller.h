// Attitude to rotor speeds (thesis B.4.1): roll and pitch by nested P-P (B.19 ... B.21), yaw by rate P (B.17) or
// heading PI (B.18), then the inverse of (B.3). Full collective leaves no room to steer: the collective gives way to
// attitude.
#pragma once

#include <array>

#include "sim/vehicle_params.h"
#include "types/frames.h"

namespace wasp::sim {

/// What the flight controller is asked for.
struct AttitudeSetpoint {
  Euler euler;               ///< [rad]
  bool yaw_by_rate = false;  ///< true: follow yaw_rate_radps, ignore euler.yaw_rad
  float yaw_rate_radps = 0;
  float thrust = 0;  ///< 0 ... 1 of full collective
};

class AttitudeController {
 public:
  explicit AttitudeController(const VehicleParams& params) : params_(params) {}

  /// Wanted rotor speeds [rad/s]: front, right, back, left. `dt_s` is for the heading integral.
  std::array<double, 4> step(const AttitudeSetpoint& setpoint, const Euler& euler, const Vec3& rate_body_radps,
                             float dt_s);
  void reset() { heading_integral_ = 0; }

 private:
  [[nodiscard]] double yaw_rate_wanted(const AttitudeSetpoint& setpoint, float yaw_rad, float dt_s);

  VehicleParams params_;
  double heading_integral_ = 0;
};

/// Rotor speeds for a collective [N] and torques about body axes [N m], within what the rotors can do.
std::array<double, 4> mix_rotors(const VehicleParams& params, double collective_N,
                                 const std::array<double, 3>& torque_Nm);

}  // namespace wasp::sim
