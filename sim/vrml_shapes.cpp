#include "sim/vrml_shapes.h"

#include <Inventor/VRMLnodes/SoVRMLColor.h>
#include <Inventor/VRMLnodes/SoVRMLCoordinate.h>
#include <Inventor/VRMLnodes/SoVRMLElevationGrid.h>
#include <Inventor/VRMLnodes/SoVRMLExtrusion.h>
#include <Inventor/VRMLnodes/SoVRMLGroup.h>
#include <Inventor/VRMLnodes/SoVRMLIndexedFaceSet.h>
#include <Inventor/VRMLnodes/SoVRMLIndexedLineSet.h>
#include <Inventor/VRMLnodes/SoVRMLNormal.h>
#include <Inventor/VRMLnodes/SoVRMLPointSet.h>
#include <Inventor/VRMLnodes/SoVRMLTextureCoordinate.h>
#include <Inventor/misc/SoChildList.h>

#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

namespace wasp::sim {
namespace {

[[noreturn]] void refuse(const std::string& why) { throw std::runtime_error(why); }

/// Values that indices point at; none when the field is empty.
template <class Node, class Values>
int count_of(const SoSFNode& field, Values Node::*values, const char* what) {
  const SoNode* node = field.getValue();
  if (node == nullptr) return 0;
  if (!node->isOfType(Node::getClassTypeId())) refuse(std::string("a node that is no ") + what + " in its place");
  return (static_cast<const Node*>(node)->*values).getNum();
}
int points(const SoSFNode& f) { return count_of(f, &SoVRMLCoordinate::point, "Coordinate"); }
int colors(const SoSFNode& f) { return count_of(f, &SoVRMLColor::color, "Color"); }
int normals(const SoSFNode& f) { return count_of(f, &SoVRMLNormal::vector, "Normal"); }
int texture_points(const SoSFNode& f) { return count_of(f, &SoVRMLTextureCoordinate::point, "TextureCoordinate"); }

void check_finite(const SoSFNode& coord) {
  if (points(coord) == 0) return;
  const SoMFVec3f& place = static_cast<const SoVRMLCoordinate*>(coord.getValue())->point;
  for (int i = 0; i < place.getNum(); ++i)
    if (!(std::abs(place[i][0]) + std::abs(place[i][1]) + std::abs(place[i][2]) < 1e30f))
      refuse("a coordinate is not finite or beyond 1e5 m");
}

/// Every index but the -1 that ends a face has its value.
void check_indices(const SoMFInt32& index, int values, const char* what) {
  for (int i = 0; i < index.getNum(); ++i)
    if (index[i] < -1 || index[i] >= values)
      refuse(std::string("an index ") + std::to_string(index[i]) + " into " + std::to_string(values) + " " + what);
}

int faces_of(const SoMFInt32& coord_index) {
  int faces = 0;
  for (int i = 0; i < coord_index.getNum(); ++i)
    if (coord_index[i] < 0 || i + 1 == coord_index.getNum()) ++faces;
  return faces;
}

/// What each corner, or each face, picks from `values`: by an index of its own, the corners' index, or in order.
void check_binding(int values, const SoMFInt32& own, const SoMFInt32& coord_index, bool per_vertex, const char* what) {
  if (values == 0) {
    if (own.getNum() > 0) check_indices(own, 0x7FFFFFFF, what);
    return;
  }
  const int needed = per_vertex ? coord_index.getNum() : faces_of(coord_index);
  const bool has_own = own.getNum() > 0;
  if (has_own && own.getNum() < needed) refuse(std::string("fewer indices than it has uses for ") + what);
  if (has_own) check_indices(own, values, what);
  if (has_own && per_vertex)
    for (int i = 0; i < coord_index.getNum(); ++i)
      if ((own[i] < 0) != (coord_index[i] < 0)) refuse(std::string("faces of other lengths in the indices of ") + what);
  if (!has_own && per_vertex) check_indices(coord_index, values, what);
  if (!has_own && !per_vertex && values < needed) refuse(std::string("fewer values than faces of ") + what);
}

void check(const SoVRMLIndexedFaceSet& s) {
  check_finite(s.coord);
  check_indices(s.coordIndex, points(s.coord), "points");
  check_binding(colors(s.color), s.colorIndex, s.coordIndex, s.colorPerVertex.getValue() != FALSE, "colours");
  check_binding(normals(s.normal), s.normalIndex, s.coordIndex, s.normalPerVertex.getValue() != FALSE, "normals");
  check_binding(texture_points(s.texCoord), s.texCoordIndex, s.coordIndex, true, "texture coordinates");
}

void check(const SoVRMLIndexedLineSet& s) {
  check_finite(s.coord);
  check_indices(s.coordIndex, points(s.coord), "points");
  check_binding(colors(s.color), s.colorIndex, s.coordIndex, s.colorPerVertex.getValue() != FALSE, "colours");
}

void check(const SoVRMLPointSet& s) {
  check_finite(s.coord);
  if (s.color.getValue() != nullptr && colors(s.color) < points(s.coord)) refuse("fewer colours than points");
}

void check(const SoVRMLElevationGrid& s) {
  const std::int64_t x = s.xDimension.getValue(), z = s.zDimension.getValue();
  if (x < 0 || z < 0 || x * z > s.height.getNum()) refuse("an ElevationGrid without its heights");
  for (int i = 0; i < s.height.getNum(); ++i)
    if (!std::isfinite(s.height[i])) refuse("a coordinate is not finite or beyond 1e5 m");
  const auto needs = [&](int values, bool per_vertex, const char* what) {
    if (values > 0 && values < (per_vertex ? x * z : (x - 1) * (z - 1)))
      refuse(std::string("an ElevationGrid without its ") + what);
  };
  needs(colors(s.color), s.colorPerVertex.getValue() != FALSE, "colours");
  needs(normals(s.normal), s.normalPerVertex.getValue() != FALSE, "normals");
  needs(texture_points(s.texCoord), true, "texture coordinates");
}

void check(const SoVRMLExtrusion& s) {
  const int spine = s.spine.getNum(), outline = s.crossSection.getNum();
  if (spine < 2 || outline < 2) refuse("an Extrusion without two points of its spine and outline");
  if (static_cast<std::int64_t>(spine) * outline > 4'000'000) refuse("an Extrusion of too many points");
  for (const int n : {s.scale.getNum(), s.orientation.getNum()})
    if (n != 1 && n < spine) refuse("an Extrusion with fewer scales or orientations than points of its spine");
  for (int i = 0; i < spine; ++i)
    if (!std::isfinite(s.spine[i][0] + s.spine[i][1] + s.spine[i][2]))
      refuse("a coordinate is not finite or beyond 1e5 m");
  for (int i = 0; i < outline; ++i)
    if (!std::isfinite(s.crossSection[i][0] + s.crossSection[i][1]))
      refuse("a coordinate is not finite or beyond 1e5 m");
}

template <class Node>
bool checked_as(const SoNode& node) {
  if (!node.isOfType(Node::getClassTypeId())) return false;
  check(static_cast<const Node&>(node));
  return true;
}

/// Instances below and including a node; -1 while its own children are counted.
using Counts = std::map<const SoNode*, double>;

double count_instances(SoNode& node, Counts& counts) {
  if (const auto known = counts.find(&node); known != counts.end()) {
    if (known->second < 0) refuse("a node that is inside itself");
    return known->second;
  }
  counts[&node] = -1;
  static_cast<void>(checked_as<SoVRMLIndexedFaceSet>(node) || checked_as<SoVRMLIndexedLineSet>(node) ||
                    checked_as<SoVRMLPointSet>(node) || checked_as<SoVRMLElevationGrid>(node) ||
                    checked_as<SoVRMLExtrusion>(node));
  double sum = 1;
  if (const SoChildList* children = node.getChildren())
    for (int i = 0; i < children->getLength(); ++i) sum += count_instances(*(*children)[i], counts);
  if (sum > kMostInstances) refuse("more than a million instances of its nodes");
  return counts[&node] = sum;
}

}  // namespace

void check_shapes(SoVRMLGroup& root) {
  Counts counts;
  count_instances(root, counts);
}

}  // namespace wasp::sim
