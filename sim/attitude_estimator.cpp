#include "sim/attitude_estimator.h"

#include <cmath>
#include <numbers>

namespace wasp::sim {
namespace {

constexpr float kStillVariance_rad2 = 1e-4f;  ///< the accelerometer's own noise
constexpr float kLevelVariance_rad2 = 0.01f;  ///< mostly unmodelled acceleration, correlated in time
constexpr float kYawVariance_rad2 = 0.02f;
constexpr float kQuietAccel_mps2 = 0.2f;
constexpr float kGravity_mps2 = 9.81f;

/// Variance of the accelerometer as a measure of level while flying.
float flying_variance(float tilt_rad) {
  const float sideways = kGravity_mps2 * std::tan(std::fmin(tilt_rad, 1.f)) / kQuietAccel_mps2;
  return kLevelVariance_rad2 * (1 + sideways * sideways);
}

}  // namespace

float wrap_angle(float angle_rad) noexcept {
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  return angle_rad - kTurn * std::ceil((angle_rad - kTurn / 2) / kTurn);
}

Euler level_from_accel(const Vec3& f) noexcept {
  return {std::atan2(-f.y(), -f.z()), std::atan2(f.x(), std::hypot(f.y(), f.z())), 0};
}

float heading_from_mag(const Vec3& m, float roll_rad, float pitch_rad) noexcept {
  const Vec3 level = quat_from_euler({roll_rad, pitch_rad, 0}) * m;
  return std::atan2(-level.y(), level.x());
}

void AttitudeEstimator::step(const ImuSample& imu, float dt_s, bool still, float tilt_rad) noexcept {
  const Vec3 accel(imu.accel_body_mps2[0], imu.accel_body_mps2[1], imu.accel_body_mps2[2]);
  const Vec3 mag(imu.mag_body_gauss[0], imu.mag_body_gauss[1], imu.mag_body_gauss[2]);
  if (samples_ == 0) yaw_.set_angle(heading_from_mag(mag, 0, 0));
  predict({imu.gyro_body_radps[0], imu.gyro_body_radps[1], imu.gyro_body_radps[2]}, dt_s);
  correct_level(accel, still ? kStillVariance_rad2 : flying_variance(tilt_rad));
  correct_yaw(mag);
  if (samples_ < 1'000'000) ++samples_;
}

/// The filters' rates are Euler rates; near level their biases are the gyro's.
void AttitudeEstimator::predict(const Vec3& gyro, float dt_s) noexcept {
  rate_body_radps_ = gyro - Vec3(roll_.bias_radps(), pitch_.bias_radps(), yaw_.bias_radps());
  const Euler e = euler();
  const float s = std::sin(e.roll_rad), c = std::cos(e.roll_rad);
  const float turn = gyro.y() * s + gyro.z() * c;
  roll_.predict(gyro.x() + std::tan(e.pitch_rad) * turn, dt_s);
  pitch_.predict(gyro.y() * c - gyro.z() * s, dt_s);
  yaw_.predict(turn / std::cos(e.pitch_rad), dt_s);
}

void AttitudeEstimator::correct_level(const Vec3& accel, float variance) noexcept {
  const Euler measured = level_from_accel(accel);
  roll_.correct(wrap_angle(measured.roll_rad - roll_.angle_rad()), variance);
  pitch_.correct(wrap_angle(measured.pitch_rad - pitch_.angle_rad()), variance);
}

void AttitudeEstimator::correct_yaw(const Vec3& mag) noexcept {
  const float measured = heading_from_mag(mag, roll_.angle_rad(), pitch_.angle_rad());
  yaw_.correct(wrap_angle(measured - yaw_.angle_rad()), kYawVariance_rad2);
  yaw_.set_angle(wrap_angle(yaw_.angle_rad()));
}

}  // namespace wasp::sim
