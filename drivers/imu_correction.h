// What `wasp calibrate` found, applied to every inertial sample: corrected = matrix (measured - neutral), the neutral
// drifting with temperature where that is known (thesis A.1; here with cross-axis terms). Pure: no clock, no ring.
#pragma once

#include <array>

#include "rt/contract.h"
#include "types/messages.h"

namespace wasp::drivers {

/// Of one three-axis sensor, in the sensor's unit in ImuSample.
struct VectorCorrection {
  std::array<float, 9> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row by row
  std::array<float, 3> neutral{};
  std::array<float, 3> neutral_per_degc{};
  float at_degc = 25;  ///< where `neutral` holds

  friend bool operator==(const VectorCorrection&, const VectorCorrection&) = default;
};

struct ImuCorrection {
  VectorCorrection accel, gyro, mag;
  float pressure_scale = 1, pressure_neutral_hpa = 1013.25f;  ///< p' = neutral + scale (p - neutral)

  friend bool operator==(const ImuCorrection&, const ImuCorrection&) = default;
};

/// Corrects samples; a sensor with the default correction keeps every bit. Realtime-safe: yes.
class ImuCorrector {
 public:
  ImuCorrector() = default;
  explicit ImuCorrector(const ImuCorrection& correction);
  void apply(ImuSample& sample) const WASP_REALTIME;

 private:
  ImuCorrection correction_;
  bool accel_ = false, gyro_ = false, mag_ = false, pressure_ = false;  ///< is there anything to correct
};

}  // namespace wasp::drivers
