// Worlds as VRML97 files: what the generators make, any VRML viewer shows and the renderer flies in. Written: one Shape
// for each texture (a PNG beside the file) with the light baked into the faces' colours. Read: any VRML97 file, through
// Coin; what was baked is taken as it is, other faces are lit by the renderer's own lamp. The first Viewpoint is the
// start. Moving parts are Transforms routed from interpolators and a TimeSensor, which starts when the viewer enters;
// for the simulator time is counted from the vehicle's leaving the ground. VRML's axes are x right, y up, -z ahead;
// north is ahead, so NED (n, e, d) is VRML (e, -d, -n).
#pragma once

#include <filesystem>

#include "sim/scene.h"

namespace wasp::sim {

/// Writes `file` and its textures (`STEM_<n>.png`) whole or not at all. Throws std::runtime_error naming the file.
void write_vrml(const Scene& scene, const std::filesystem::path& file);

/// Reads a VRML97 file. Throws std::runtime_error naming the file, and the line where Coin knows it: a file that is not
/// VRML97 or does not parse, no geometry, a coordinate that is not finite or beyond 1e5 m, a texture that is missing or
/// no image. Faces without area are left out.
Scene read_vrml(const std::filesystem::path& file);

}  // namespace wasp::sim
