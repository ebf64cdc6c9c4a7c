#include "sim/attitude_controller.h"

#include <algorithm>
#include <cmath>

#include "sim/attitude_estimator.h"

namespace wasp::sim {
namespace {

constexpr double kAngleGain_ps = 4.0;  ///< K_p-dot of (B.19)
constexpr double kRateGain_ps = 11.0;  ///< K_p of (B.20), per unit of inertia
constexpr double kMaxRate_radps = 2.5;
constexpr double kYawGain_ps = 3.0;      ///< K_py of (B.17), per unit of inertia
constexpr double kHeadingGain_ps = 1.2;  ///< (B.18)
constexpr double kHeadingIntegral_ps2 = 0.1;
constexpr double kMaxYawRate_radps = 1.0;
constexpr double kMaxYawTorque_Nm = 0.025;  ///< keeps room for roll and pitch near full collective

}  // namespace

double AttitudeController::yaw_rate_wanted(const AttitudeSetpoint& setpoint, float yaw_rad, float dt_s) {
  if (setpoint.yaw_by_rate) {
    heading_integral_ = 0;
    return std::clamp(static_cast<double>(setpoint.yaw_rate_radps), -kMaxYawRate_radps, kMaxYawRate_radps);
  }
  const auto error = static_cast<double>(wrap_angle(setpoint.euler.yaw_rad - yaw_rad));
  heading_integral_ =
      std::clamp(heading_integral_ + kHeadingIntegral_ps2 * error * static_cast<double>(dt_s), -0.1, 0.1);
  return std::clamp(kHeadingGain_ps * error + heading_integral_, -kMaxYawRate_radps, kMaxYawRate_radps);
}

std::array<double, 4> AttitudeController::step(const AttitudeSetpoint& setpoint, const Euler& euler,
                                               const Vec3& rate_body_radps, float dt_s) {
  const auto torque = [](double inertia, float error_rad, float rate) {
    const double wanted = std::clamp(kAngleGain_ps * static_cast<double>(error_rad), -kMaxRate_radps, kMaxRate_radps);
    return inertia * kRateGain_ps * (wanted - static_cast<double>(rate));
  };
  const InertiaRow& I = params_.inertia_kgm2;
  const double yaw =
      I.zz * kYawGain_ps * (yaw_rate_wanted(setpoint, euler.yaw_rad, dt_s) - static_cast<double>(rate_body_radps.z()));
  return mix_rotors(params_, static_cast<double>(setpoint.thrust) * params_.max_collective_N(),
                    {torque(I.xx, setpoint.euler.roll_rad - euler.roll_rad, rate_body_radps.x()),
                     torque(I.yy, setpoint.euler.pitch_rad - euler.pitch_rad, rate_body_radps.y()),
                     std::clamp(yaw, -kMaxYawTorque_Nm, kMaxYawTorque_Nm)});
}

std::array<double, 4> mix_rotors(const VehicleParams& p, double collective_N, const std::array<double, 3>& torque_Nm) {
  const double roll = torque_Nm[0] / (2 * p.arm_m), pitch = torque_Nm[1] / (2 * p.arm_m);
  const double yaw = torque_Nm[2] * p.rotor.b() / (4 * p.rotor.d()), base = collective_N / 4;
  std::array<double, 4> thrust{base + pitch - yaw, base - roll + yaw, base - pitch - yaw, base + roll + yaw};
  const double excess = *std::max_element(thrust.begin(), thrust.end()) - p.rotor.max_thrust_N;
  std::array<double, 4> speed{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double t = std::clamp(thrust[i] - std::max(0.0, excess), 0.0, p.rotor.max_thrust_N);
    speed[i] = std::sqrt(t / p.rotor.b());
  }
  return speed;
}

}  // namespace wasp::sim
