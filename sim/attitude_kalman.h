// One axis of attitude: state [angle, gyro bias], driven by the gyro, corrected by an angle (B.23 ... B.31 with the
// terms that (B.28) and (B.29) lose put back). A = [1 -dt; 0 1], B = [dt; 0], H = [1 0].
#pragma once

namespace wasp::sim {

struct AttitudeKalmanParams {
  float angle_psd = 1e-7f;  ///< Q_a per second [rad^2/s]
  float bias_psd = 5e-9f;   ///< Q_g per second [(rad/s)^2/s]
};

class AttitudeKalman {
 public:
  explicit AttitudeKalman(const AttitudeKalmanParams& params = {}) : params_(params) {}

  /// Integrates the measured rate [rad/s] over `dt_s` > 0.
  void predict(float rate_radps, float dt_s) noexcept {
    angle_rad_ += dt_s * (rate_radps - bias_radps_);
    p11_ += -dt_s * (p12_ + p21_) + dt_s * dt_s * p22_ + params_.angle_psd * dt_s;
    p12_ -= dt_s * p22_;
    p21_ -= dt_s * p22_;
    p22_ += params_.bias_psd * dt_s;
  }
  /// Corrects by `innovation` = measured angle - angle (wrapped by the caller), of variance `R_rad2` > 0.
  void correct(float innovation_rad, float R_rad2) noexcept {
    const float s = p11_ + R_rad2;
    const float k1 = p11_ / s, k2 = p21_ / s;
    angle_rad_ += k1 * innovation_rad;
    bias_radps_ += k2 * innovation_rad;
    p21_ -= k2 * p11_;
    p22_ -= k2 * p12_;
    p11_ *= 1 - k1;
    p12_ *= 1 - k1;
  }
  void set_angle(float angle_rad) noexcept { angle_rad_ = angle_rad; }

  [[nodiscard]] float angle_rad() const noexcept { return angle_rad_; }
  [[nodiscard]] float bias_radps() const noexcept { return bias_radps_; }
  [[nodiscard]] float angle_variance_rad2() const noexcept { return p11_; }

 private:
  AttitudeKalmanParams params_;
  float angle_rad_ = 0, bias_radps_ = 0;
  float p11_ = 0.1f, p12_ = 0, p21_ = 0, p22_ = 4e-4f;
};

}  // namespace wasp::sim
