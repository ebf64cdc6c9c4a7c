// Looking at a camera before flying with it: what is plugged in, and pictures of it.
#pragma once

#include "tools/camera_options.h"

namespace wasp::tools {

/// `wasp camera --list`. Returns the exit code: 0, or 4 when nothing is there.
int list_cameras(bool json);
/// `wasp camera --save DIR`: PNG files of the front camera. Throws CameraError. Returns the exit code.
int save_pictures(const CameraOptions& options, const scheduling::Config& config);

/// What the flight was promised of the front camera, or of the one that looks down.
drivers::CameraRequest front_request(const scheduling::Config& config);
drivers::CameraRequest down_request(const scheduling::Config& config);

}  // namespace wasp::tools
