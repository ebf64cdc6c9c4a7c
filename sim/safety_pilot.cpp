#include "sim/safety_pilot.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace wasp::sim {
namespace {

constexpr double kPilotStep_s = 0.005;
constexpr double kBandwidth_radps = 2 * std::numbers::pi * 0.2;
constexpr double kDamping = 0.8;
constexpr double kMaxTilt_rad = 3 * std::numbers::pi / 180, kMaxCruiseTilt_rad = 12 * std::numbers::pi / 180;
constexpr float kLetGo_rad = std::numbers::pi_v<float> / 180;
constexpr double kGravity_mps2 = 9.81;
constexpr double kCruiseHeight_m = 0.4, kCruiseEndHeight_m = 0.3, kCruiseAfter_s = 2, kCruiseAccel_mps2 = 0.5;
constexpr double kHeadingGain_ps = 0.8, kMaxHeadingRate_radps = 0.3;

double yaw_of(const VehicleState& truth) {
  const Eigen::Vector3d ahead = truth.q_ned_body * Eigen::Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

}  // namespace

PilotTrim SafetyPilot::step(const VehicleState& truth, const AttitudeSetpoint& commanded, bool active) {
  if (!enabled_ || !active) {
    flying_ = holding_ = cruising_ = false;
    point_mps_ = way_m_ = high_for_s_ = 0;
    return {};
  }
  if (!flying_) hold_yaw_rad_ = yaw_of(truth);
  flying_ = true;
  watch_height(-truth.position_ned_m.z());
  const bool let_go = std::hypot(commanded.euler.roll_rad, commanded.euler.pitch_rad) > kLetGo_rad;
  if (let_go) {
    holding_ = false;
    return {0, 0, heading_rate(yaw_of(truth))};
  }
  if (!holding_) hold_ned_m_ = truth.position_ned_m.head<2>();
  holding_ = true;
  if (params_.cruise_mps > 0) move_point();
  return hold(truth);
}

/// Cruise begins after a while well above the ground, and ends near it.
void SafetyPilot::watch_height(double height_m) {
  high_for_s_ = height_m > kCruiseHeight_m ? high_for_s_ + kPilotStep_s : 0;
  if (high_for_s_ > kCruiseAfter_s) cruising_ = true;
  if (height_m < kCruiseEndHeight_m) cruising_ = false;
}

/// Speeds up and slows down at the same rate, so that it comes to rest where its way ends.
void SafetyPilot::move_point() {
  double wanted_mps = cruising_ ? params_.cruise_mps : 0;
  if (params_.cruise_distance_m > 0) {
    const double left_m = std::max(0.0, params_.cruise_distance_m - way_m_);
    wanted_mps = std::min(wanted_mps, std::sqrt(2 * kCruiseAccel_mps2 * left_m));
  }
  const double change = kCruiseAccel_mps2 * kPilotStep_s;
  point_mps_ = std::clamp(wanted_mps, point_mps_ - change, point_mps_ + change);
  hold_ned_m_.x() += point_mps_ * kPilotStep_s;
  way_m_ += point_mps_ * kPilotStep_s;
}

PilotTrim SafetyPilot::hold(const VehicleState& truth) const {
  const Eigen::Vector2d position = truth.position_ned_m.head<2>(), velocity = truth.velocity_ned_mps.head<2>();
  const Eigen::Vector2d accel = kBandwidth_radps * kBandwidth_radps * (hold_ned_m_ - position) -
                                2 * kDamping * kBandwidth_radps * (velocity - Eigen::Vector2d(point_mps_, 0));
  const Eigen::Vector3d forward = truth.q_ned_body * Eigen::Vector3d::UnitX();
  const Eigen::Vector2d ahead = forward.head<2>().normalized(), right(-ahead.y(), ahead.x());
  Eigen::Vector2d tilt(accel.dot(right) / kGravity_mps2, -accel.dot(ahead) / kGravity_mps2);
  const double limit = params_.cruise_mps > 0 ? kMaxCruiseTilt_rad : kMaxTilt_rad;
  if (tilt.norm() > limit) tilt *= limit / tilt.norm();
  return {static_cast<float>(tilt.x()), static_cast<float>(tilt.y()), heading_rate(yaw_of(truth))};
}

float SafetyPilot::heading_rate(double yaw_rad) const {
  if (!params_.hold_heading) return 0;
  const double error = std::remainder(hold_yaw_rad_ - yaw_rad, 2 * std::numbers::pi);
  return static_cast<float>(std::clamp(kHeadingGain_ps * error, -kMaxHeadingRate_radps, kMaxHeadingRate_radps));
}

}  // namespace wasp::sim
