// Which of a camera's picture formats to take: pure choice over what it says it offers.
#pragma once

#include <string>
#include <vector>

#include "drivers/camera_driver.h"
#include "drivers/pixel_rows.h"
#include "drivers/v4l2_device.h"

namespace wasp::drivers {

/// A picture format this driver can turn into grey.
struct V4l2Pixels {
  std::uint32_t fourcc;
  const char* name;
  bool jpeg;
  GrayLayout layout;
};

/// nullptr: none of ours.
const V4l2Pixels* find_pixels(std::uint32_t fourcc);

/// The first format in our order of preference (grey, planar, packed, JPEG) that has the size at the rate, else at the
/// size alone; `settings.pixel_format` allows only that one. Throws CameraError saying what is offered instead.
V4l2Mode choose_mode(const std::vector<V4l2Mode>& offered, const CameraRequest& request, const std::string& device);

/// "GREY 640x480 30 15 Hz".
std::string mode_text(const V4l2Mode& mode);

}  // namespace wasp::drivers
