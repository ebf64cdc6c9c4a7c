// The frames the guest replays: one second of the simulated Kinect, seeded, closed to a loop. Rendered on the host, for
// the guest has no renderer.
#pragma once

#include <filesystem>

namespace wasp::tools::rt_guest {

/// Writes a recording of 30 frames 640 x 480 into `folder` (the layout of wasp-record --frames).
/// Throws std::runtime_error naming the file.
void make_clip(const std::filesystem::path& folder);

}  // namespace wasp::tools::rt_guest
