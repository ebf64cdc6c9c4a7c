#include "calibration/calibrations.h"

#include <array>

#include "calibration/calibrate_baro.h"
#include "calibration/calibrate_camera.h"
#include "calibration/calibrate_delay.h"
#include "calibration/calibrate_gyro.h"
#include "calibration/calibrate_heading_rate.h"
#include "calibration/calibrate_kinect_depth.h"
#include "calibration/calibrate_kinect_pair.h"
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
      Calibration{"kinect-depth", "a Kinect's raw values to depth, from a wall at known distances", &prepare_kinect_depth},
      Calibration{"kinect-extrinsics", "a Kinect's two lenses and how they stand to each other, from pairs of images",
                  &prepare_kinect_pair},
      Calibration{"delay", "a camera's stamps behind the gyro's, from how both saw the vehicle turn", &prepare_delay},
      Calibration{"heading-rate", "the heading rate behaviour's scale, from a turntable run under a camera that looks down",
                  &prepare_heading_rate},
  };
  return kCalibrations;
}

}  // namespace wasp::calibration
