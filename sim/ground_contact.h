// Four feet on the floor z = 0: each a stiff, well damped spring that only pushes, with regularised Coulomb friction.
// The springs are overdamped, so a landing does not bounce.
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "sim/vehicle_params.h"

namespace wasp::sim {

struct ContactForce {
  Eigen::Vector3d force_ned_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque_body_Nm = Eigen::Vector3d::Zero();
  bool touching = false;
};

class GroundContact {
 public:
  explicit GroundContact(const VehicleParams& params);

  [[nodiscard]] ContactForce at(const Eigen::Vector3d& position_ned_m, const Eigen::Vector3d& velocity_ned_mps,
                                const Eigen::Quaterniond& q_ned_body, const Eigen::Vector3d& rate_body_radps) const;

 private:
  std::array<Eigen::Vector3d, 4> feet_body_m_;
  double stiffness_Npm_, damping_Nspm_;
};

}  // namespace wasp::sim
