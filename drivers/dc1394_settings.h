// Video mode, frame rate, shutter, gain and trigger of an IIDC camera: set as the configuration says, read back as they
// came out.
#pragma once

#include <string>
#include <vector>

#include "drivers/camera_driver.h"
#include "drivers/dc1394_bus.h"

namespace wasp::drivers {

/// What is in force.
struct Dc1394Mode {
  dc1394video_mode_t mode = DC1394_VIDEO_MODE_640x480_MONO8;
  std::string pixels;  ///< "MONO8" or "F7_0"
  int width_px = 0, height_px = 0;
  double rate_hz = 0;  ///< 0: the camera does not say
};

/// Mono8 of the size asked for: the fixed mode if the camera has it at that rate, else a region in the middle of its
/// Format 7 sensor, whose packets are as large as the rate needs. pixel_format "MONO8" or "F7_0" ... "F7_7" allows only
/// that one. Throws CameraError saying what is offered.
Dc1394Mode set_mode(const Dc1394Device& device, const CameraRequest& request);

struct Dc1394Features {
  DurationNs exposure_ns = 0;  ///< 0: unknown
  std::string text;            ///< for people
};
/// Throws CameraError when the camera refuses what was asked for.
Dc1394Features set_features(const Dc1394Device& device, const CameraRequest& request);

/// One line for every mode with mono8 pictures.
std::vector<std::string> mode_lines(const Dc1394Device& device);

}  // namespace wasp::drivers
