// One motor with its propeller and speed regulator: dw/dt = (K/R (v - K w) - d w^2) / J (B.5). The regulator adds to
// the steady voltage of the wanted speed what gives a first-order response; 0 ... supply voltage bounds it, so large
// steps are slower than small ones, as on the vehicle.
#pragma once

#include "sim/vehicle_params.h"

namespace wasp::sim {

class Rotor {
 public:
  explicit Rotor(const RotorParams& params);

  /// Advances by `dt_s` towards `wanted_radps` (held within 0 ... full speed).
  void step(double wanted_radps, double dt_s);

  [[nodiscard]] double speed_radps() const { return speed_radps_; }
  [[nodiscard]] double acceleration_radps2() const { return acceleration_radps2_; }
  [[nodiscard]] double thrust_N() const { return b_ * speed_radps_ * speed_radps_; }
  [[nodiscard]] double drag_torque_Nm() const { return d_ * speed_radps_ * speed_radps_; }
  void set_speed(double radps) { speed_radps_ = radps; }

 private:
  [[nodiscard]] double voltage(double wanted_radps) const;

  RotorParams params_;
  double b_, d_, resistance_ohm_, max_radps_;
  double speed_radps_ = 0, acceleration_radps2_ = 0;
};

}  // namespace wasp::sim
