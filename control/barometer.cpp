#include "control/barometer.h"

#include <cmath>

namespace wasp::control {
namespace {

void learn(const BarometerParams& p, float zero_m, BarometerState& s) noexcept {
  if (std::fabs(zero_m - s.zero_m) <= p.max_jump_m) {
    s.zero_m += p.learning_gain * (zero_m - s.zero_m);
    s.jumps = 0;
  } else if (++s.jumps >= p.jumps_to_accept) {
    s = {true, zero_m};
  }
}

}  // namespace

float pressure_altitude_m(float pressure_hpa) noexcept {
  return 44330.77f * (1.f - std::pow(pressure_hpa / 1013.25f, 0.190263f));
}

void PressureMean::add(const ImuSample& sample) noexcept {
  if ((sample.fields & kImuHasPressure) == 0 || !std::isfinite(sample.pressure_hpa) || sample.pressure_hpa <= 0) return;
  sum_hpa_ += static_cast<double>(sample.pressure_hpa);
  ++count_;
}

float PressureMean::take() noexcept {
  const float mean_hpa = count_ > 0 ? static_cast<float>(sum_hpa_ / count_) : 0.f;
  *this = PressureMean{};
  return mean_hpa;
}

bool barometer_step(const BarometerParams& p, float pressure_hpa, bool standing, bool seen, float height_m_now,
                    BarometerState& s, float& height_m) noexcept {
  if (!p.enabled || !std::isfinite(pressure_hpa) || pressure_hpa < 300.f || pressure_hpa > 1200.f) return false;
  const float altitude_m = pressure_altitude_m(pressure_hpa);
  const float zero_m = altitude_m - (seen ? height_m_now : p.standing_height_m);
  if (!s.started) s = {true, zero_m};
  if (seen || standing) learn(p, zero_m, s);
  height_m = altitude_m - s.zero_m;
  return true;
}

}  // namespace wasp::control
