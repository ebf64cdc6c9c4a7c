// Rigid body with four rotors, linear drag and legs: Newton-Euler (B.1) without the small-angle terms of (B.2),
// semi-implicit Euler in steps of one millisecond, attitude by the exponential of the body rate. NED and FRD.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "sim/ground_contact.h"
#include "sim/rotor.h"
#include "sim/vehicle_params.h"

namespace wasp::sim {

inline constexpr double kPhysicsStep_s = 1e-3;

struct VehicleState {
  Eigen::Vector3d position_ned_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_ned_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d rate_body_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d specific_force_body_mps2{0, 0, -9.81};  ///< what an ideal accelerometer reads
  bool on_ground = true;
};

class Vehicle {
 public:
  /// Stands on the floor z = 0 at the origin, heading north.
  explicit Vehicle(const VehicleParams& params);

  /// Of the air, from now on; drag acts on the motion through it.
  void set_wind(const Eigen::Vector3d& wind_ned_mps) { wind_ned_mps_ = wind_ned_mps; }
  /// One millisecond with these wanted rotor speeds [rad/s], front, right, back, left.
  void step(const std::array<double, 4>& wanted_radps);

  [[nodiscard]] const VehicleState& state() const { return state_; }
  [[nodiscard]] const VehicleParams& params() const { return params_; }
  [[nodiscard]] const Rotor& rotor(std::size_t i) const { return rotors_[i]; }
  /// Puts the vehicle somewhere, for tests and replays; all rotors at `rotor_radps`.
  void reset(const VehicleState& state, double rotor_radps = 0);

 private:
  struct Wrench {
    Eigen::Vector3d force_ned_N = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque_body_Nm = Eigen::Vector3d::Zero();
  };
  [[nodiscard]] Wrench rotor_wrench() const;
  void integrate(const Wrench& wrench);

  VehicleParams params_;
  Eigen::Vector3d inertia_;
  std::vector<Rotor> rotors_;
  GroundContact contact_;
  VehicleState state_;
  Eigen::Vector3d wind_ned_mps_ = Eigen::Vector3d::Zero();
};

}  // namespace wasp::sim
