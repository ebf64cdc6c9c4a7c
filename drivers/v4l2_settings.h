// Exposure, gain and frame rate of a V4L2 camera: set as the configuration says, read back as they came out.
#pragma once

#include <string>

#include "drivers/camera_driver.h"
#include "drivers/v4l2_device.h"

namespace wasp::drivers {

struct V4l2Settings {
  double rate_hz = 0;          ///< 0: the device does not say
  DurationNs exposure_ns = 0;  ///< 0: unknown
  std::string text;            ///< for people: what is in force, and what the camera did not take
};

/// Throws CameraError when the camera refuses a fixed exposure or gain that was asked for.
V4l2Settings apply_settings(const V4l2Device& device, const CameraRequest& request);

}  // namespace wasp::drivers
