#include "sim/vehicle.h"

#include <cmath>

namespace wasp::sim {
namespace {

/// +1: the propeller turns clockwise seen from above (positive about body z).
constexpr std::array<double, 4> kSpin{1, -1, 1, -1};

Eigen::Quaterniond rotation_of(const Eigen::Vector3d& angle_rad) {
  const double norm = angle_rad.norm();
  if (norm < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(norm, angle_rad / norm));
}

}  // namespace

Vehicle::Vehicle(const VehicleParams& params)
    : params_(params),
      inertia_(params.inertia_kgm2.xx, params.inertia_kgm2.yy, params.inertia_kgm2.zz),
      rotors_(4, Rotor(params.rotor)),
      contact_(params) {
  state_.position_ned_m.z() = -params.leg_m;
  state_.specific_force_body_mps2.z() = -params.gravity_mps2;
}

void Vehicle::reset(const VehicleState& state, double rotor_radps) {
  state_ = state;
  for (auto& rotor : rotors_) rotor.set_speed(rotor_radps);
}

void Vehicle::step(const std::array<double, 4>& wanted_radps) {
  for (std::size_t i = 0; i < 4; ++i) rotors_[i].step(wanted_radps[i], kPhysicsStep_s);
  Wrench wrench = rotor_wrench();
  wrench.force_ned_N -= params_.drag_Npmps * (state_.velocity_ned_mps - wind_ned_mps_);
  const ContactForce contact =
      contact_.at(state_.position_ned_m, state_.velocity_ned_mps, state_.q_ned_body, state_.rate_body_radps);
  state_.on_ground = contact.touching;
  wrench.force_ned_N += contact.force_ned_N;
  wrench.torque_body_Nm += contact.torque_body_Nm;
  integrate(wrench);
}

/// (B.3) in FRD: front thrust pitches up, left thrust rolls right; propeller drag and spin-up turn the body the other
/// way.
Vehicle::Wrench Vehicle::rotor_wrench() const {
  double collective_N = 0, yaw_Nm = 0, momentum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    collective_N += rotors_[i].thrust_N();
    yaw_Nm -= kSpin[i] * (rotors_[i].drag_torque_Nm() + params_.rotor.inertia_kgm2 * rotors_[i].acceleration_radps2());
    momentum += kSpin[i] * params_.rotor.inertia_kgm2 * rotors_[i].speed_radps();
  }
  Wrench wrench;
  wrench.force_ned_N = state_.q_ned_body * Eigen::Vector3d(0, 0, -collective_N);
  wrench.torque_body_Nm = {params_.arm_m * (rotors_[3].thrust_N() - rotors_[1].thrust_N()),
                           params_.arm_m * (rotors_[0].thrust_N() - rotors_[2].thrust_N()), yaw_Nm};
  wrench.torque_body_Nm -= state_.rate_body_radps.cross(Eigen::Vector3d(0, 0, momentum));
  return wrench;
}

void Vehicle::integrate(const Wrench& wrench) {
  VehicleState& s = state_;
  const Eigen::Vector3d specific_ned = wrench.force_ned_N / params_.mass_kg;
  s.specific_force_body_mps2 = s.q_ned_body.conjugate() * specific_ned;
  s.velocity_ned_mps += (specific_ned + Eigen::Vector3d(0, 0, params_.gravity_mps2)) * kPhysicsStep_s;
  s.position_ned_m += s.velocity_ned_mps * kPhysicsStep_s;
  const Eigen::Vector3d momentum = inertia_.cwiseProduct(s.rate_body_radps);
  const Eigen::Vector3d torque = wrench.torque_body_Nm - s.rate_body_radps.cross(momentum);
  s.rate_body_radps += torque.cwiseQuotient(inertia_) * kPhysicsStep_s;
  s.q_ned_body = (s.q_ned_body * rotation_of(s.rate_body_radps * kPhysicsStep_s)).normalized();
}

}  // namespace wasp::sim
