// What a search through Coin's graph found, as what it is.
#pragma once

#include <Inventor/SoFullPath.h>

namespace wasp::sim {

/// The node a path ends at; nullptr if it is of another type. A path's own tail is another node where one stands inside
/// a node whose children Coin hides, as the geometry of a Shape: a foreign file can have any node there.
template <class Node>
Node* tail_of(SoPath* path) {
  SoNode* node = path == nullptr ? nullptr : static_cast<SoFullPath*>(path)->getTail();
  return node != nullptr && node->isOfType(Node::getClassTypeId()) ? static_cast<Node*>(node) : nullptr;
}

}  // namespace wasp::sim
