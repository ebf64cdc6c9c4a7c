// A camera's geometry as the keys of a TOML section: what the simulator's configuration says once, told to the flight
// process and to a recording.
#pragma once

#include <string>

#include "types/camera.h"

namespace wasp::tools {

/// One "key = value" a line: size, intrinsics, lens, mount. A mount that is not a pitch about the body's right axis
/// is beyond these keys. Floats keep every bit.
std::string camera_keys(const CameraGeometry& camera);

}  // namespace wasp::tools
