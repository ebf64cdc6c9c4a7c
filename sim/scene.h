// A world and where a flight in it begins, and the generators of all of them (algorithms page, section 13): the same
// seed makes the same scene.
#pragma once

#include <span>
#include <string>

#include "sim/world.h"

namespace wasp::sim {

struct Scene {
  World world;
  Vec3 start_ned_m = Vec3::Zero();  ///< on the ground below the vehicle
  float start_yaw_rad = 0;          ///< from north towards east
  std::string title;
};

/// Moves the world so that the start is the origin and its heading north: what the simulator flies in.
World placed_at_start(const Scene& scene);

/// One kind of scene.
struct SceneKind {
  const char* name;
  const char* what;
  Scene (*make)(std::uint32_t seed);
};

/// laboratory, corridor, corridor-bend, corridor-doorway, corridor-obstacles, office, city, arena, wall, ground.
std::span<const SceneKind> scene_kinds();

/// Throws std::runtime_error that lists the kinds when `kind` is none of them.
Scene make_scene(const std::string& kind, std::uint32_t seed);

/// Straw's arena (Straw, Lee and Dickinson 2010; thesis fig. 7.19): a round room whose wall is dark above an edge at
/// `edge_height_m` and light below it.
Scene make_arena(std::uint32_t seed, float edge_height_m);

}  // namespace wasp::sim
