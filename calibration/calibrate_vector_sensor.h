// `wasp calibrate accel` and `mag`: neutrals and scale factors of a three-axis sensor from the constancy of what it
// measures (thesis A.2.4.1, A.1 - A.3). An accelerometer counts only where it lay still.
#pragma once

#include "calibration/calibration.h"
#include "calibration/ellipsoid_fit.h"
#include "calibration/samples.h"

namespace wasp::calibration {

/// What differs between the two sensors.
struct VectorSensor {
  Sensor sensor = Sensor::kAccel;
  const char* name = "accel";
  double norm = 0;              ///< flight unit; 0: the mean scale is kept (magnetometer)
  double most_residual = 0.01;  ///< rms, share of the norm, above which the model does not hold
  double most_sigma = 0.01;     ///< of neutrals and scales, share of the norm
  const char* flight_unit = "m/s^2";
};

struct VectorSensorOptions {
  SampleOptions samples;
  VectorSensor sensor;
  std::string model = "auto";        ///< auto | axes | full
  std::string temperature = "auto";  ///< auto | off
  bool rows_are_rests = false;       ///< each row is already the mean of a rest
};

/// Solves it; throws Refusal. `bar` is shown.
Solution solve_vector_sensor(const VectorSensorOptions& options, ProgressBar& bar);

std::function<Solution(ProgressBar&)> prepare_accel(CLI::App& app);
std::function<Solution(ProgressBar&)> prepare_mag(CLI::App& app);

}  // namespace wasp::calibration
