#include "sim/vrml_motion.h"

#include <Inventor/SbMatrix.h>
#include <Inventor/VRMLnodes/SoVRMLGroup.h>
#include <Inventor/VRMLnodes/SoVRMLOrientationInterpolator.h>
#include <Inventor/VRMLnodes/SoVRMLPositionInterpolator.h>
#include <Inventor/VRMLnodes/SoVRMLTimeSensor.h>
#include <Inventor/VRMLnodes/SoVRMLTransform.h>
#include <Inventor/actions/SoSearchAction.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

#include "sim/vrml_search.h"

namespace wasp::sim {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

[[noreturn]] void refuse(const SoVRMLTransform& transform, const std::string& why) {
  throw std::runtime_error("moving Transform " + std::string(transform.getName().getString()) + ": " + why);
}

/// The engine of type `Engine` behind a field; nullptr when there is none.
template <class Engine>
const Engine* engine_behind(const SoField& field) {
  SoEngineOutput* output = nullptr;
  if (!field.getConnectedEngine(output) || output == nullptr || !output->isNodeEngineOutput()) return nullptr;
  const SoNodeEngine* engine = output->getNodeContainer();
  return engine != nullptr && engine->isOfType(Engine::getClassTypeId()) ? static_cast<const Engine*>(engine) : nullptr;
}

/// One value over time; VRML holds the first value before the first key and the last after the last.
template <class Value>
struct Track {
  std::vector<float> at_s;
  std::vector<Value> values;
  Value resting;  ///< without keys

  [[nodiscard]] Value at(float t_s) const {
    if (at_s.empty()) return resting;
    const auto after = std::upper_bound(at_s.begin(), at_s.end(), t_s) - at_s.begin();
    const auto i = static_cast<std::size_t>(after);
    if (i == 0) return values.front();
    if (i == at_s.size()) return values.back();
    const float share = (t_s - at_s[i - 1]) / (at_s[i] - at_s[i - 1]);
    return Value(values[i - 1] + share * (values[i] - values[i - 1]));
  }
};

/// Keys rise; of two equal ones, a jump, the second is put off by the least that a float can say.
std::vector<float> times_of(const SoVRMLTransform& node, const SoMFFloat& key, int values, float cycle_s) {
  if (key.getNum() == 0 || key.getNum() != values) refuse(node, "its interpolator has not one value for each key");
  std::vector<float> times;
  for (int i = 0; i < key.getNum(); ++i) {
    if (!(key[i] >= 0.f && key[i] <= 1.f) || (i > 0 && key[i] < key[i - 1]))
      refuse(node, "the keys of its interpolator do not rise within 0 ... 1");
    times.push_back(key[i] * cycle_s);
  }
  for (std::size_t i = 1; i < times.size(); ++i)
    if (times[i] <= times[i - 1]) times[i] = std::nextafter(times[i - 1], 2 * cycle_s);
  return times;
}

Track<Vec3> path_of(const SoVRMLTransform& node, const SoVRMLPositionInterpolator* path, float cycle_s) {
  const SbVec3f rest = node.translation.getValue();
  Track<Vec3> track{{}, {}, Vec3(rest[0], rest[1], rest[2])};
  if (path == nullptr) return track;
  track.at_s = times_of(node, path->key, path->keyValue.getNum(), cycle_s);
  for (int i = 0; i < path->keyValue.getNum(); ++i)
    track.values.emplace_back(path->keyValue[i][0], path->keyValue[i][1], path->keyValue[i][2]);
  for (const Vec3& p : track.values)
    if (!p.allFinite()) refuse(node, "a place on its path is not finite");
  return track;
}

/// Yaw (clockwise seen from above) of a rotation about the vertical, nearest to `before`.
float yaw_of(const SoVRMLTransform& node, const SbRotation& rotation, float before) {
  SbVec3f up, ahead;
  rotation.multVec(SbVec3f(0, 1, 0), up);
  rotation.multVec(SbVec3f(0, 0, -1), ahead);
  if (!(up[1] > 0.9999f)) refuse(node, "it turns about another axis than the vertical");
  const float yaw = std::atan2(ahead[0], -ahead[2]);
  return yaw + 2 * kPi * std::round((before - yaw) / (2 * kPi));
}

Track<float> turn_of(const SoVRMLTransform& node, const SoVRMLOrientationInterpolator* turn, float cycle_s) {
  Track<float> track{{}, {}, 0};
  if (turn == nullptr) return track;
  track.at_s = times_of(node, turn->key, turn->keyValue.getNum(), cycle_s);
  float before = 0;
  for (int i = 0; i < turn->keyValue.getNum(); ++i)
    track.values.push_back(before = yaw_of(node, turn->keyValue[i], before));
  return track;
}

/// The one clock behind both; nullptr when nothing drives them.
const SoVRMLTimeSensor* clock_of(const SoVRMLTransform& node, const SoVRMLInterpolator* path,
                                 const SoVRMLInterpolator* turn) {
  const auto behind = [](const SoVRMLInterpolator* i) {
    return i == nullptr ? nullptr : engine_behind<SoVRMLTimeSensor>(i->set_fraction);
  };
  const SoVRMLTimeSensor *a = behind(path), *b = behind(turn);
  if (a != nullptr && b != nullptr && a != b) refuse(node, "place and rotation have clocks of their own");
  return a != nullptr ? a : b;
}

VrmlMotion motion_of(const SoVRMLTransform& node, const SoVRMLPositionInterpolator* path,
                     const SoVRMLOrientationInterpolator* turn, const SoVRMLTimeSensor& clock) {
  const auto cycle_s = static_cast<float>(clock.cycleInterval.getValue().getValue());
  if (!(cycle_s > 0.f && cycle_s < 1e6f)) refuse(node, "its clock's cycleInterval is not within 0 ... 1e6 s");
  if (turn != nullptr && node.center.getValue().length() > 1e-6f) refuse(node, "it turns about a center of its own");
  const Track<Vec3> places = path_of(node, path, cycle_s);
  const Track<float> yaws = turn_of(node, turn, cycle_s);
  std::set<float> times{0.f};
  times.insert(places.at_s.begin(), places.at_s.end());
  times.insert(yaws.at_s.begin(), yaws.at_s.end());
  VrmlMotion motion;
  motion.looped = clock.loop.getValue() != FALSE;
  if (motion.looped) times.insert(std::max(cycle_s, *times.rbegin()));
  motion.turns = turn != nullptr;
  for (const float t : times) motion.keys.push_back({t, {places.at(t), yaws.at(t)}});
  return motion;
}

Vec3 ned_of(const SbVec3f& p) { return {-p[2], p[0], -p[1]}; }

/// Uniform in scale and upright, so that turning about the vertical means the same before and after it.
bool upright(const SbMatrix& m) {
  SbVec3f x, y, z;
  m.multDirMatrix(SbVec3f(1, 0, 0), x);
  m.multDirMatrix(SbVec3f(0, 1, 0), y);
  m.multDirMatrix(SbVec3f(0, 0, 1), z);
  const float size = x.length(), slack = 1e-4f * size;
  return std::abs(x[1]) < slack && std::abs(z[1]) < slack && std::abs(y[0]) < slack && std::abs(y[2]) < slack &&
         std::abs(z.length() - size) < slack && std::abs(x.dot(z)) < slack * size && x.cross(y).dot(z) > 0.f;
}

}  // namespace

VrmlMotions take_motions(SoVRMLGroup& root) {
  SoSearchAction search;
  search.setType(SoVRMLTransform::getClassTypeId());
  search.setInterest(SoSearchAction::ALL);
  search.setSearchingAll(TRUE);
  search.apply(&root);
  VrmlMotions motions;
  for (int i = 0; i < search.getPaths().getLength(); ++i) {
    auto* node = tail_of<SoVRMLTransform>(search.getPaths()[i]);
    if (node == nullptr) continue;
    const auto* path = engine_behind<SoVRMLPositionInterpolator>(node->translation);
    const auto* turn = engine_behind<SoVRMLOrientationInterpolator>(node->rotation);
    const SoVRMLTimeSensor* clock = clock_of(*node, path, turn);
    node->translation.enableConnection(FALSE);
    node->rotation.enableConnection(FALSE);
    if (clock == nullptr || motions.contains(node)) continue;
    motions[node] = motion_of(*node, path, turn, *clock);
    node->translation.setValue(0, 0, 0);
    if (turn != nullptr) node->rotation.setValue(SbVec3f(0, 1, 0), 0);
  }
  return motions;
}

std::vector<MoverKey> keys_in_world(const VrmlMotion& motion, const SbMatrix& parent) {
  if (motion.turns && !upright(parent))
    throw std::runtime_error("a moving Transform turns inside one that is tilted or unevenly scaled");
  std::vector<MoverKey> keys = motion.keys;
  for (MoverKey& key : keys) {
    const Vec3& p = key.place.position_ned_m;
    SbVec3f place;
    parent.multVecMatrix(SbVec3f(p.x(), p.y(), p.z()), place);
    key.place.position_ned_m = ned_of(place);
  }
  return keys;
}

}  // namespace wasp::sim
