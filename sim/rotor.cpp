#include "sim/rotor.h"

#include <algorithm>

namespace wasp::sim {

Rotor::Rotor(const RotorParams& params)
    : params_(params),
      b_(params.b()),
      d_(params.d()),
      resistance_ohm_(params.resistance_ohm()),
      max_radps_(params.max_speed_radps()) {}

double Rotor::voltage(double wanted_radps) const {
  const double k = params_.motor_constant;
  const double steady_V = k * wanted_radps + resistance_ohm_ * d_ * wanted_radps * wanted_radps / k;
  // The natural pole (B.7) is slower than the regulator's; the difference is made up in proportion to the error.
  const double natural =
      k * k / (params_.inertia_kgm2 * resistance_ohm_) + 2 * d_ * wanted_radps / params_.inertia_kgm2;
  const double gain = (1 / params_.regulator_s - natural) * params_.inertia_kgm2 * resistance_ohm_ / k;
  return std::clamp(steady_V + std::max(0.0, gain) * (wanted_radps - speed_radps_), 0.0, params_.supply_V);
}

void Rotor::step(double wanted_radps, double dt_s) {
  const double k = params_.motor_constant, w = speed_radps_;
  const double v = voltage(std::clamp(wanted_radps, 0.0, max_radps_));
  acceleration_radps2_ = (k / resistance_ohm_ * (v - k * w) - d_ * w * w) / params_.inertia_kgm2;
  speed_radps_ = std::max(0.0, w + acceleration_radps2_ * dt_s);
}

}  // namespace wasp::sim
