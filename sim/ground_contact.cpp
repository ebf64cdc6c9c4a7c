#include "sim/ground_contact.h"

#include <algorithm>

namespace wasp::sim {
namespace {

constexpr double kStiffness_Npm = 3000;
constexpr double kDampingRatio = 1.5;
constexpr double kFriction = 0.7;
constexpr double kSlipSpeed_mps = 0.05;  ///< below this the friction falls linearly to zero

Eigen::Vector3d push(double depth_m, const Eigen::Vector3d& v, double stiffness, double damping) {
  const double normal_N = std::max(0.0, stiffness * depth_m + damping * v.z());
  const Eigen::Vector2d slip(v.x(), v.y());
  const Eigen::Vector2d friction = -kFriction * normal_N * slip / std::max(slip.norm(), kSlipSpeed_mps);
  return {friction.x(), friction.y(), -normal_N};
}

}  // namespace

GroundContact::GroundContact(const VehicleParams& p)
    : stiffness_Npm_(kStiffness_Npm), damping_Nspm_(2 * kDampingRatio * std::sqrt(kStiffness_Npm * p.mass_kg / 4)) {
  // Legs are longer by what the springs give way, so that the body stands at leg_m exactly.
  const double leg_m = p.leg_m + p.mass_kg * p.gravity_mps2 / (4 * kStiffness_Npm);
  const double s = p.foot_spread_m;
  feet_body_m_ = {Eigen::Vector3d(s, s, leg_m), Eigen::Vector3d(s, -s, leg_m), Eigen::Vector3d(-s, s, leg_m),
                  Eigen::Vector3d(-s, -s, leg_m)};
}

ContactForce GroundContact::at(const Eigen::Vector3d& position_ned_m, const Eigen::Vector3d& velocity_ned_mps,
                               const Eigen::Quaterniond& q_ned_body, const Eigen::Vector3d& rate_body_radps) const {
  ContactForce sum;
  for (const auto& foot : feet_body_m_) {
    const double depth_m = (position_ned_m + q_ned_body * foot).z();
    if (depth_m <= 0) continue;
    const Eigen::Vector3d velocity = velocity_ned_mps + q_ned_body * rate_body_radps.cross(foot);
    const Eigen::Vector3d force = push(depth_m, velocity, stiffness_Npm_, damping_Nspm_);
    sum.force_ned_N += force;
    sum.torque_body_Nm += foot.cross(q_ned_body.conjugate() * force);
    sum.touching = true;
  }
  return sum;
}

}  // namespace wasp::sim
