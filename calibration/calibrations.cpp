#include "calibration/calibrations.h"

#include <array>

#include "calibration/calibrate_baro.h"
#include "calibration/calibrate_camera.h"
#include "calibration/calibrate_gyro.h"
#include "calibration/calibrate_vector_sensor.h"

namespace wasp::calibration {

std::span<const Calibration> calibrations() {
  static constexpr std::array kCalibrations = {
      Calibration{"accel", "accelerometer: neutrals and scale factors from rest in many orientations", &prepare_accel},
      Calibration{"mag", "magnetometer: the same from turning through all orientations", &prepare_mag},
      Calibration{"gyro", "gyroscope: bias from rest, scales from a turntable", &prepare_gyro},
      Calibration{"baro", "barometer: a line through readings at known heights", &prepare_baro},
      Calibration{"camera", "intrinsics and distortion, pinhole or fisheye, from images of a chessboard",
                  &prepare_camera},
  };
  return kCalibrations;
}

}  // namespace wasp::calibration
