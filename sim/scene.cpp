#include "sim/scene.h"

#include <cmath>
#include <stdexcept>

#include "sim/lab_world.h"
#include "sim/scene_generators.h"

namespace wasp::sim {
namespace {

Scene laboratory(const SceneOptions& o) {
  return {make_lab({o.seed, o.floor_edges_per_m, o.cartons}), Vec3::Zero(), 0, "laboratory"};
}
Scene arena(const SceneOptions& o) { return make_arena(o.seed, 1.f); }
Scene arena_step(const SceneOptions& o) { return make_arena(o.seed, arena_step_of(o.seed, o.arena_step_at_s)); }
Scene city(const SceneOptions& o) { return make_city(o.seed, o.city); }
Scene edges(const SceneOptions& o) { return make_edges(o.seed, o.ground_edges_per_m); }

/// A generator that asks for nothing but a seed.
template <Scene (*kMake)(std::uint32_t)>
Scene seeded(const SceneOptions& o) {
  return kMake(o.seed);
}

constexpr SceneKind kKinds[] = {
    {"laboratory", "12 m x 10 m plank floor, benches, shelves, cartons", &laboratory},
    {"corridor", "30 m straight, 2.6 m wide, doors and notices", &seeded<make_corridor>},
    {"corridor-bend", "15 m, a right angle to the right, 12 m", &seeded<make_corridor_bend>},
    {"corridor-doorway", "a partition with a doorway 1.1 m wide after 10 m", &seeded<make_corridor_doorway>},
    {"corridor-obstacles", "cartons along the walls, a way left between them", &seeded<make_corridor_obstacles>},
    {"corridor-people", "cartons along one wall, two people walking along the other", &seeded<make_corridor_people>},
    {"office", "twelve rooms with doors, desks and cabinets", &seeded<make_office>},
    {"city", "70 m of low boxes, heights a sinusoidally modulated exponential", &city},
    {"city-tall", "the same to 15 m height, 200 m long", &seeded<make_city_tall>},
    {"arena", "Straw's round arena, edge at 1 m", &arena},
    {"arena-step", "the same, softly textured; the edge moves by a step up or down", &arena_step},
    {"wall", "a textured wall 6 to 8 m ahead, up to 15 degrees askew", &seeded<make_wall>},
    {"ground", "textured ground, nothing else", &seeded<make_ground>},
    {"edges", "grey stripes across the ground, their edges a Poisson process", &edges},
};

}  // namespace

std::span<const SceneKind> scene_kinds() { return kKinds; }

std::string scene_kind_names() {
  std::string names;
  for (const SceneKind& k : kKinds) names += std::string(names.empty() ? "" : ", ") + k.name;
  return names;
}

const SceneKind* find_scene_kind(const std::string& kind) {
  for (const SceneKind& k : kKinds)
    if (kind == k.name) return &k;
  return nullptr;
}

Scene make_scene(const std::string& kind, const SceneOptions& options) {
  const SceneKind* known = find_scene_kind(kind);
  if (known == nullptr) throw std::runtime_error("no kind of world '" + kind + "'; known: " + scene_kind_names());
  return known->make(options);
}

World placed_at_start(const Scene& scene) {
  const Mat3 R = Eigen::AngleAxisf(-scene.start_yaw_rad, Vec3::UnitZ()).toRotationMatrix();
  World world = scene.world;
  for (std::size_t quad = 0; quad < world.still_quads(); ++quad) {
    Surface& s = world.surfaces[quad];
    s.u0 += s.u_axis.dot(scene.start_ned_m), s.v0 += s.v_axis.dot(scene.start_ned_m);
    s.u_axis = R * s.u_axis, s.v_axis = R * s.v_axis, s.normal = R * s.normal;
  }
  std::vector<bool> moves(world.vertices_ned_m.size());
  for (std::size_t quad = world.still_quads(); quad < world.quads.size(); ++quad)
    for (const std::uint32_t v : world.quads[quad]) moves[v] = true;
  for (std::size_t v = 0; v < moves.size(); ++v)
    if (!moves[v]) world.vertices_ned_m[v] = R * (world.vertices_ned_m[v] - scene.start_ned_m);
  for (Mover& mover : world.movers)
    for (MoverKey& key : mover.keys) {
      key.place.position_ned_m = R * (key.place.position_ned_m - scene.start_ned_m);
      key.place.yaw_rad -= scene.start_yaw_rad;
    }
  return world;
}

}  // namespace wasp::sim
