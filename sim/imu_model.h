// Inertial sensors, compass and barometer with their errors: white noise, a constant bias drawn at start, and a bias
// that walks. Noise figures are per sample at 200 Hz and typical of the thesis' analogue parts (A.2.4); our estimates.
#pragma once

#include <array>

#include "sim/random.h"
#include "sim/vehicle.h"
#include "types/messages.h"

namespace wasp::sim {

struct ImuParams {
  double gyro_noise_radps = 0.004;
  double gyro_bias_radps = 0.01;        ///< standard deviation of the constant bias
  double gyro_walk_radps_sqrts = 2e-5;  ///< random walk [rad/s per root second]
  double accel_noise_mps2 = 0.08;
  double accel_bias_mps2 = 0.02;  ///< what calibration leaves
  double accel_walk_mps2_sqrts = 2e-4;
  double mag_noise_gauss = 0.004;
  double pressure_noise_hpa = 0.02;  ///< 0.17 m
};

/// Field of the laboratory, NED: pointing north and down, no declination [gauss].
inline const Eigen::Vector3d kMagneticField_ned_gauss{0.21, 0.0, 0.45};

class ImuModel {
 public:
  ImuModel(const ImuParams& params, std::uint32_t seed);

  /// One sample, `dt_s` after the last; `exposed_at_ns` is copied through.
  ImuSample sample(const VehicleState& state, double dt_s, TimeNs exposed_at_ns);

  [[nodiscard]] const Eigen::Vector3d& gyro_bias_radps() const { return gyro_bias_; }

 private:
  Eigen::Vector3d noise(double sigma);

  ImuParams params_;
  Random random_;
  Eigen::Vector3d gyro_bias_, accel_bias_;
  std::uint32_t sequence_ = 0;
};

/// Standard atmosphere near the ground: pressure at `height_m` above the floor, 1013.25 hPa at the floor.
double pressure_hpa(double height_m);
double height_of_pressure_m(double pressure_hpa);

}  // namespace wasp::sim
