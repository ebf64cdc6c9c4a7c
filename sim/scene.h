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

/// The low city: boxes on a square grid, each within its own cell.
struct CityOptions {
  double length_m = 70, half_width_m = 26;     ///< along x; to either side
  double free_before_m = 6, free_after_m = 8;  ///< no boxes within these of the ends
  double pitch_m = 3;                          ///< of the grid; a box fills 72 to 92 % of it each way
  double mean_low_m = 0.6, mean_high_m = 2;    ///< of the exponential, where the sinusoid is low and high
  double period_m = 25;                        ///< of the sinusoid along x
  double lowest_m = 0.3, tallest_m = 4;        ///< heights are cut to these
  double windowed = 0.3;                       ///< share of boxes with windows
};

/// What decides a generated scene, besides its kind.
struct SceneOptions {
  std::uint32_t seed = 1;
  double floor_edges_per_m = 3.1;    ///< laboratory: lambda of the floor's plank borders
  int cartons = 9;                   ///< laboratory: on the floor, 0 ... 40
  double ground_edges_per_m = 0.35;  ///< edges: lambda of the ground's stripes
  double arena_step_at_s = 10;       ///< arena-step: when the edge moves, after the vehicle first left the ground
  CityOptions city{};
};

/// One kind of scene.
struct SceneKind {
  const char* name;
  const char* what;
  Scene (*make)(const SceneOptions& options);
};

/// laboratory, corridor, corridor-bend, corridor-doorway, corridor-obstacles, office, city, arena, wall, ground ...
std::span<const SceneKind> scene_kinds();
/// Their names, comma separated, for messages.
std::string scene_kind_names();
/// nullptr when `kind` is none of them.
const SceneKind* find_scene_kind(const std::string& kind);

/// Throws std::runtime_error that lists the kinds when `kind` is none of them.
Scene make_scene(const std::string& kind, const SceneOptions& options);
inline Scene make_scene(const std::string& kind, std::uint32_t seed) { return make_scene(kind, {.seed = seed}); }

/// Straw's arena (Straw, Lee and Dickinson 2010; thesis fig. 7.19): a round room whose wall is dark above an edge at
/// `edge_height_m` and light below it.
Scene make_arena(std::uint32_t seed, float edge_height_m);

/// The edge's step: from one height to another at `at_s`.
struct ArenaStep {
  float from_m = 1, to_m = 1.4f, at_s = 10;
};
inline constexpr float kArenaStepTakes_s = 0.02f;

/// From the seed: from 0.9 ... 1.5 m, up or down by 0.3 ... 0.6 m.
ArenaStep arena_step_of(std::uint32_t seed, double at_s);
/// The arena with its edge moving so.
Scene make_arena(std::uint32_t seed, const ArenaStep& step);

/// The start lies up to 1.5 m north of the edge of the map and up to 8 m to either side, from the seed.
Scene make_city(std::uint32_t seed, const CityOptions& options);

}  // namespace wasp::sim
