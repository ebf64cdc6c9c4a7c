// A scene as bytes, from one process of this program to another: native byte order, no version. What comes back is
// judged as a stranger's, for the process that wrote it may have been on its way to a crash.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim/scene.h"

namespace wasp::sim {

std::vector<std::uint8_t> scene_bytes(const Scene& scene);

/// The same scene to the bit. Throws std::runtime_error with the reason: bytes missing or left over, an index without
/// its vertex or texture, a moving part that is none, a number that is not finite.
Scene scene_of_bytes(std::span<const std::uint8_t> bytes);

}  // namespace wasp::sim
