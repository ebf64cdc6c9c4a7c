#include "sim/safety_pilot.h"

#include <cmath>
#include <numbers>

namespace wasp::sim {
namespace {

constexpr double kBandwidth_radps = 2 * std::numbers::pi * 0.2;
constexpr double kDamping = 0.8;
constexpr double kMaxTilt_rad = 3 * std::numbers::pi / 180;
constexpr float kLetGo_rad = std::numbers::pi_v<float> / 180;
constexpr double kGravity_mps2 = 9.81;

}  // namespace

PilotTrim SafetyPilot::step(const VehicleState& truth, const AttitudeSetpoint& commanded, bool active) {
  const bool let_go = std::hypot(commanded.euler.roll_rad, commanded.euler.pitch_rad) > kLetGo_rad;
  if (!enabled_ || !active || let_go) {
    holding_ = false;
    return {};
  }
  const Eigen::Vector2d position = truth.position_ned_m.head<2>(), velocity = truth.velocity_ned_mps.head<2>();
  if (!holding_) hold_ned_m_ = position;
  holding_ = true;
  const Eigen::Vector2d accel =
      kBandwidth_radps * kBandwidth_radps * (hold_ned_m_ - position) - 2 * kDamping * kBandwidth_radps * velocity;
  const Eigen::Vector3d forward = truth.q_ned_body * Eigen::Vector3d::UnitX();
  const Eigen::Vector2d ahead = forward.head<2>().normalized(), right(-ahead.y(), ahead.x());
  Eigen::Vector2d tilt(accel.dot(right) / kGravity_mps2, -accel.dot(ahead) / kGravity_mps2);
  if (tilt.norm() > kMaxTilt_rad) tilt *= kMaxTilt_rad / tilt.norm();
  return {static_cast<float>(tilt.x()), static_cast<float>(tilt.y())};
}

}  // namespace wasp::sim
