// Roll, pitch and yaw by three Kalman filters (thesis B.4.2): gyro predicts, accelerometer corrects roll and pitch,
// compass corrects yaw. A flying quadrotor's accelerometer does not feel its tilt while it accelerates sideways, so the
// measurement's variance grows with the sideways acceleration that the tilt implies.
#pragma once

#include "sim/attitude_kalman.h"
#include "types/frames.h"
#include "types/messages.h"

namespace wasp::sim {

class AttitudeEstimator {
 public:
  /// One IMU sample. `still`: known to rest, so that the accelerometer is to be believed. `tilt_rad` >= 0: the larger
  /// of commanded and estimated tilt.
  void step(const ImuSample& imu, float dt_s, bool still, float tilt_rad) noexcept;

  [[nodiscard]] Euler euler() const noexcept { return {roll_.angle_rad(), pitch_.angle_rad(), yaw_.angle_rad()}; }
  /// Gyro rates less the estimated biases [rad/s].
  [[nodiscard]] Vec3 rate_body_radps() const noexcept { return rate_body_radps_; }
  [[nodiscard]] bool settled() const noexcept { return samples_ > 400; }  ///< after 2 s

 private:
  void predict(const Vec3& gyro, float dt_s) noexcept;
  void correct_level(const Vec3& accel, float variance_rad2) noexcept;
  void correct_yaw(const Vec3& mag) noexcept;

  AttitudeKalman roll_, pitch_, yaw_;
  Vec3 rate_body_radps_ = Vec3::Zero();
  int samples_ = 0;
};

/// Angle in (-pi, pi].
float wrap_angle(float angle_rad) noexcept;

/// Roll and pitch of a body at rest from its specific force (level: 0, 0, -g); yaw is left 0.
Euler level_from_accel(const Vec3& accel_body_mps2) noexcept;
/// Heading from a magnetometer at known roll and pitch [rad].
float heading_from_mag(const Vec3& mag_body, float roll_rad, float pitch_rad) noexcept;

}  // namespace wasp::sim
