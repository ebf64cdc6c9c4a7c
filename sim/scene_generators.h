// The scenes of sim/scene.h, one function each. North is ahead; the floor is at z = 0 [m].
#pragma once

#include <cstdint>
#include <initializer_list>

#include "sim/scene.h"

namespace wasp::sim {

Scene make_corridor(std::uint32_t seed);
Scene make_corridor_bend(std::uint32_t seed);
Scene make_corridor_doorway(std::uint32_t seed);
Scene make_corridor_obstacles(std::uint32_t seed);
Scene make_corridor_people(std::uint32_t seed);
Scene make_office(std::uint32_t seed);
Scene make_city_tall(std::uint32_t seed);
Scene make_wall(std::uint32_t seed);
Scene make_ground(std::uint32_t seed);
/// Thesis figs 7.8 to 7.12: plain strips of two greys across the ground, 200 m deep, whose borders along x are a
/// Poisson process of `edges_per_m` > 0. No texture, no fine grain.
Scene make_edges(std::uint32_t seed, double edges_per_m);

inline constexpr float kCorridorWidth_m = 2.6f, kCorridorHeight_m = 2.6f, kCorridorLength_m = 30.f;

/// Index of each texture of these scenes in World::textures; 1 is the renderer's fine grain.
enum SceneTexture : int {
  kBlank,
  kGrain,
  kNatural,
  kFacade,
  kStreet,
  kWallpaper,
  kDoor,
  kNotices,
  kCarton,
  kPlainFacade,
  kSoft,
  kCloth
};

/// A world with these textures (and kBlank and kGrain) and nothing else. Painting is most of a scene's making, some
/// 30 ms a texture: the others stay blank.
World empty_world(std::uint32_t seed, std::initializer_list<SceneTexture> used);

}  // namespace wasp::sim
