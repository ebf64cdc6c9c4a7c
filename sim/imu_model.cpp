#include "sim/imu_model.h"

#include <cmath>

namespace wasp::sim {
namespace {

constexpr double kSeaLevel_hpa = 1013.25;
constexpr double kScaleHeight_m = 44330.8, kExponent = 5.25588;

std::array<float, 3> to_floats(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

double pressure_hpa(double height_m) { return kSeaLevel_hpa * std::pow(1 - height_m / kScaleHeight_m, kExponent); }
double height_of_pressure_m(double p) { return kScaleHeight_m * (1 - std::pow(p / kSeaLevel_hpa, 1 / kExponent)); }

ImuModel::ImuModel(const ImuParams& params, std::uint32_t seed)
    : params_(params),
      random_(seed),
      gyro_bias_(noise(params.gyro_bias_radps)),
      accel_bias_(noise(params.accel_bias_mps2)) {}

Eigen::Vector3d ImuModel::noise(double sigma) {
  const double x = random_.normal(), y = random_.normal(), z = random_.normal();
  return sigma * Eigen::Vector3d(x, y, z);
}

ImuSample ImuModel::sample(const VehicleState& state, double dt_s, TimeNs exposed_at_ns) {
  gyro_bias_ += noise(params_.gyro_walk_radps_sqrts * std::sqrt(dt_s));
  accel_bias_ += noise(params_.accel_walk_mps2_sqrts * std::sqrt(dt_s));
  ImuSample s;
  s.exposed_at_ns = exposed_at_ns;
  s.sequence = sequence_++;
  s.gyro_body_radps = to_floats(state.rate_body_radps + gyro_bias_ + noise(params_.gyro_noise_radps));
  s.accel_body_mps2 = to_floats(state.specific_force_body_mps2 + accel_bias_ + noise(params_.accel_noise_mps2));
  s.mag_body_gauss =
      to_floats(state.q_ned_body.conjugate() * kMagneticField_ned_gauss + noise(params_.mag_noise_gauss));
  const double p = pressure_hpa(-state.position_ned_m.z()) + params_.pressure_noise_hpa * random_.normal();
  s.pressure_hpa = static_cast<float>(p);
  s.temperature_degc = 21.f;
  s.fields = 0x1bff;  // accel, gyro, mag, absolute pressure, pressure altitude, temperature
  return s;
}

}  // namespace wasp::sim
