// IIDC cameras through libdc1394 (Point Grey Firefly MV and its kin): mono8, frames taken from the DMA ring without
// ever waiting in the library. docs/cameras.md says which settings it obeys and what its time stamps mean.
#pragma once

#include <memory>
#include <vector>

#include "drivers/camera_driver.h"

namespace wasp::drivers {

std::unique_ptr<CameraDriver> make_dc1394_camera(const CameraRequest& request);
std::vector<FoundCamera> list_dc1394_cameras();

}  // namespace wasp::drivers
