// A parsed VRML97 graph, looked through before it is traversed: Coin trusts indices, and walks as many instances as USE
// makes of one node.
#pragma once

class SoVRMLGroup;

namespace wasp::sim {

inline constexpr double kMostInstances = 1e6;  ///< of all nodes together

/// Throws std::runtime_error with the reason: a node inside itself, too many instances, an index without its value, a
/// grid or an outline of impossible size, a number that is not finite.
void check_shapes(SoVRMLGroup& root);

}  // namespace wasp::sim
