// Height and climb rate for the descent without a companion: a third-order complementary filter of vertical
// acceleration and barometric height, all three poles at 0.5 rad/s, so that an accelerometer bias is found and removed.
#pragma once

#include "types/frames.h"

namespace wasp::sim {

class VerticalEstimator {
 public:
  /// `up_mps2`: vertical acceleration, gravity removed, up positive. `height_m`: barometric.
  void step(float up_mps2, float height_m, float dt_s) noexcept {
    if (!started_) height_m_ = height_m;
    started_ = true;
    constexpr float kPole = 0.5f;
    const float error = height_m - height_m_;
    bias_mps2_ -= kPole * kPole * kPole * error * dt_s;
    climb_mps_ += (up_mps2 - bias_mps2_ + 3 * kPole * kPole * error) * dt_s;
    height_m_ += (climb_mps_ + 3 * kPole * error) * dt_s;
  }
  [[nodiscard]] float height_m() const noexcept { return height_m_; }
  [[nodiscard]] float climb_mps() const noexcept { return climb_mps_; }

 private:
  bool started_ = false;
  float height_m_ = 0, climb_mps_ = 0, bias_mps2_ = 0;
};

/// Upward acceleration of the vehicle from its specific force and attitude [m/s^2].
inline float up_acceleration(const Vec3& accel_body_mps2, const Euler& euler) noexcept {
  const Vec3 specific_ned = quat_from_euler({euler.roll_rad, euler.pitch_rad, 0}) * accel_body_mps2;
  return -(specific_ned.z() + 9.81f);
}

}  // namespace wasp::sim
