#include "drivers/imu_correction.h"

#include "drivers/autopilot_samples.h"

namespace wasp::drivers {
namespace {

void correct(const VectorCorrection& c, bool warmth_known, float degc, std::array<float, 3>& v) WASP_REALTIME {
  const float warmer = warmth_known ? degc - c.at_degc : 0.f;
  std::array<float, 3> d;
  for (std::size_t i = 0; i < 3; ++i) d[i] = v[i] - c.neutral[i] - c.neutral_per_degc[i] * warmer;
  for (std::size_t i = 0; i < 3; ++i)
    v[i] = c.matrix[3 * i] * d[0] + c.matrix[3 * i + 1] * d[1] + c.matrix[3 * i + 2] * d[2];
}

}  // namespace

ImuCorrector::ImuCorrector(const ImuCorrection& correction)
    : correction_(correction),
      accel_(!(correction.accel == VectorCorrection{})),
      gyro_(!(correction.gyro == VectorCorrection{})),
      mag_(!(correction.mag == VectorCorrection{})),
      pressure_(correction.pressure_scale < 1.f || correction.pressure_scale > 1.f) {}

void ImuCorrector::apply(ImuSample& s) const WASP_REALTIME {
  // A field bit says that a value is new, not that it is there: an old one is corrected as well.
  const bool warmth_known = (s.fields & kFieldTemperature) != 0 || s.temperature_degc != 0.f;
  const bool mag_there = s.mag_body_gauss != std::array<float, 3>{};
  if (accel_) correct(correction_.accel, warmth_known, s.temperature_degc, s.accel_body_mps2);
  if (gyro_) correct(correction_.gyro, warmth_known, s.temperature_degc, s.gyro_body_radps);
  if (mag_ && mag_there) correct(correction_.mag, warmth_known, s.temperature_degc, s.mag_body_gauss);
  if (pressure_ && s.pressure_hpa > 0)
    s.pressure_hpa = correction_.pressure_neutral_hpa +
                     correction_.pressure_scale * (s.pressure_hpa - correction_.pressure_neutral_hpa);
}

}  // namespace wasp::drivers
