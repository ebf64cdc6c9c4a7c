#include "control/barometer.h"

#include <cmath>

namespace wasp::control {

float pressure_altitude_m(float pressure_hpa) noexcept {
  return 44330.77f * (1.f - std::pow(pressure_hpa / 1013.25f, 0.190263f));
}

bool barometer_step(const BarometerParams& p, float pressure_hpa, bool standing, bool seen, float seen_height_m,
                    BarometerState& s, float& height_m) noexcept {
  if (!p.enabled || !std::isfinite(pressure_hpa) || pressure_hpa < 300.f || pressure_hpa > 1200.f) return false;
  const float altitude_m = pressure_altitude_m(pressure_hpa);
  const bool reference = seen || standing;
  const float zero_m = altitude_m - (seen ? seen_height_m : p.standing_height_m);
  if (!s.started) s = {true, zero_m};
  if (reference) s.zero_m += p.learning_gain * (zero_m - s.zero_m);
  height_m = altitude_m - s.zero_m;
  return true;
}

}  // namespace wasp::control
