// Moving parts of a VRML97 file: a Transform whose translation or rotation is routed from a PositionInterpolator or an
// OrientationInterpolator that a TimeSensor drives. Other animation (colours, scales) is not seen: such things stand as
// the file says.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "sim/mover.h"

class SbMatrix;
class SoVRMLGroup;
class SoVRMLTransform;

namespace wasp::sim {

/// A Transform's motion in its parent's frame. Positions are VRML's (x, y, z), as in the file.
struct VrmlMotion {
  std::vector<MoverKey> keys;
  bool looped = false, turns = false;
};
using VrmlMotions = std::map<const SoVRMLTransform*, VrmlMotion>;

/// Takes every motion out of the graph: what moved stands at its parent's origin afterwards. Throws std::runtime_error
/// with the reason when one cannot be flown in: keys that do not rise within 0 ... 1, values missing or not finite, a
/// rotation about anything but the vertical, two clocks for one Transform.
VrmlMotions take_motions(SoVRMLGroup& root);

/// The same motion in the world (NED) where the parent's frame is `parent`. Throws when the part turns and its parent
/// is tilted or unevenly scaled.
std::vector<MoverKey> keys_in_world(const VrmlMotion& motion, const SbMatrix& parent);

}  // namespace wasp::sim
