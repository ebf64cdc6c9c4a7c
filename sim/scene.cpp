#include "sim/scene.h"

#include <cmath>
#include <stdexcept>

#include "sim/lab_world.h"
#include "sim/scene_generators.h"

namespace wasp::sim {
namespace {

Scene laboratory(std::uint32_t seed) { return {make_lab({.seed = seed}), Vec3::Zero(), 0, "laboratory"}; }
Scene arena(std::uint32_t seed) { return make_arena(seed, 1.f); }

constexpr SceneKind kKinds[] = {
    {"laboratory", "12 m x 10 m plank floor, benches, shelves, cartons", &laboratory},
    {"corridor", "30 m straight, 2.4 m wide, doors and notices", &make_corridor},
    {"corridor-bend", "15 m, a right angle to the right, 12 m", &make_corridor_bend},
    {"corridor-doorway", "a partition with a doorway 1.1 m wide after 10 m", &make_corridor_doorway},
    {"corridor-obstacles", "cartons and pillars along the walls, a way left between them", &make_corridor_obstacles},
    {"office", "twelve rooms with doors, desks and cabinets", &make_office},
    {"city", "boxes whose heights are a sinusoidally modulated exponential", &make_city},
    {"arena", "Straw's round arena, edge at 1 m", &arena},
    {"wall", "a textured wall 10 m ahead", &make_wall},
    {"ground", "textured ground, nothing else", &make_ground},
};

}  // namespace

std::span<const SceneKind> scene_kinds() { return kKinds; }

Scene make_scene(const std::string& kind, std::uint32_t seed) {
  std::string known;
  for (const SceneKind& k : kKinds) {
    if (kind == k.name) return k.make(seed);
    known += std::string(known.empty() ? "" : ", ") + k.name;
  }
  throw std::runtime_error("no kind of world '" + kind + "'; known: " + known);
}

World placed_at_start(const Scene& scene) {
  const Mat3 R = Eigen::AngleAxisf(-scene.start_yaw_rad, Vec3::UnitZ()).toRotationMatrix();
  World world = scene.world;
  for (Vec3& v : world.vertices_ned_m) v = R * (v - scene.start_ned_m);
  for (Surface& s : world.surfaces) {
    s.u0 += s.u_axis.dot(scene.start_ned_m), s.v0 += s.v_axis.dot(scene.start_ned_m);
    s.u_axis = R * s.u_axis, s.v_axis = R * s.v_axis, s.normal = R * s.normal;
  }
  return world;
}

}  // namespace wasp::sim
