#include "drivers/autopilot_samples.h"

#include <cmath>

#include "types/frames.h"

namespace wasp::drivers {
namespace {

template <class... Floats>
bool finite(Floats... values) noexcept {
  return (std::isfinite(values) && ...);
}

bool finite(const std::array<float, 3>& v) noexcept { return finite(v[0], v[1], v[2]); }

/// Keeps a finite side channel; else clears it and its field bits.
bool keep_if_finite(bool is_finite, std::uint32_t bits, ImuSample& sample, float* values, std::size_t n) noexcept {
  if (is_finite) return true;
  for (std::size_t i = 0; i < n; ++i) values[i] = 0.f;
  sample.fields &= ~bits;
  return false;
}

template <class Imu>
Finiteness convert_scaled(const Imu& from, ImuSample& to) noexcept {
  constexpr float kMps2PerMilliG = 9.80665e-3f, kMilli = 1e-3f, kCenti = 1e-2f;
  const auto scaled = [](float unit, std::int16_t x, std::int16_t y, std::int16_t z) noexcept {
    return std::array<float, 3>{unit * static_cast<float>(x), unit * static_cast<float>(y),
                                unit * static_cast<float>(z)};
  };
  to.accel_body_mps2 = scaled(kMps2PerMilliG, from.xacc, from.yacc, from.zacc);
  to.gyro_body_radps = scaled(kMilli, from.xgyro, from.ygyro, from.zgyro);
  to.mag_body_gauss = scaled(kMilli, from.xmag, from.ymag, from.zmag);
  to.temperature_degc = kCenti * static_cast<float>(from.temperature);
  to.fields = kFieldCoarse | kFieldAccel | kFieldGyro | kFieldMag | (from.temperature != 0 ? kFieldTemperature : 0u);
  return Finiteness::kWhole;
}

Finiteness normalise(const Quat& q, AttitudeSample& to) noexcept {
  const float norm = q.norm();
  if (!(norm > 0.5f && norm < 2.f)) return Finiteness::kRefused;  // NaN fails both
  to.q_ned_body = {q.w() / norm, q.x() / norm, q.y() / norm, q.z() / norm};
  return Finiteness::kWhole;
}

}  // namespace

Finiteness convert(const mavlink::HighresImu& from, ImuSample& to) WASP_REALTIME {
  to.accel_body_mps2 = {from.xacc, from.yacc, from.zacc};
  to.gyro_body_radps = {from.xgyro, from.ygyro, from.zgyro};
  to.mag_body_gauss = {from.xmag, from.ymag, from.zmag};
  to.pressure_hpa = from.abs_pressure;
  to.temperature_degc = from.temperature;
  to.fields = from.fields_updated;
  if (!finite(to.accel_body_mps2) || !finite(to.gyro_body_radps)) return Finiteness::kRefused;
  const bool mag = keep_if_finite(finite(to.mag_body_gauss), kFieldMag, to, to.mag_body_gauss.data(), 3);
  const bool pressure = keep_if_finite(finite(to.pressure_hpa), kFieldPressure, to, &to.pressure_hpa, 1);
  const bool heat = keep_if_finite(finite(to.temperature_degc), kFieldTemperature, to, &to.temperature_degc, 1);
  return mag && pressure && heat ? Finiteness::kWhole : Finiteness::kPartial;
}

Finiteness convert(const mavlink::ScaledImu& from, ImuSample& to) WASP_REALTIME { return convert_scaled(from, to); }

Finiteness convert(const mavlink::RawImu& from, ImuSample& to) WASP_REALTIME { return convert_scaled(from, to); }

Finiteness convert(const mavlink::AttitudeQuaternion& from, AttitudeSample& to) WASP_REALTIME {
  to.rate_body_radps = {from.rollspeed, from.pitchspeed, from.yawspeed};
  if (!finite(to.rate_body_radps)) return Finiteness::kRefused;
  return normalise(Quat(from.q1, from.q2, from.q3, from.q4), to);
}

Finiteness convert(const mavlink::Attitude& from, AttitudeSample& to) WASP_REALTIME {
  to.rate_body_radps = {from.rollspeed, from.pitchspeed, from.yawspeed};
  if (!finite(to.rate_body_radps) || !finite(from.roll, from.pitch, from.yaw)) return Finiteness::kRefused;
  return normalise(quat_from_euler({from.roll, from.pitch, from.yaw}), to);
}

}  // namespace wasp::drivers
