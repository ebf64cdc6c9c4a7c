// Video4Linux2: frames from memory the kernel's driver fills, grey as it is or converted straight into the ring slot.
// docs/cameras.md says which settings it obeys and what its time stamps mean.
#pragma once

#include <memory>
#include <vector>

#include "drivers/camera_driver.h"

namespace wasp::drivers {

std::unique_ptr<CameraDriver> make_v4l2_camera(const CameraRequest& request);
std::vector<FoundCamera> list_v4l2_cameras();

}  // namespace wasp::drivers
