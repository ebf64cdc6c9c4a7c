// The scenes of sim/scene.h, one function each. North is ahead; the floor is at z = 0 [m].
#pragma once

#include <cstdint>

#include "sim/scene.h"

namespace wasp::sim {

Scene make_corridor(std::uint32_t seed);
Scene make_corridor_bend(std::uint32_t seed);
Scene make_corridor_doorway(std::uint32_t seed);
Scene make_corridor_obstacles(std::uint32_t seed);
Scene make_office(std::uint32_t seed);
Scene make_city(std::uint32_t seed);
Scene make_wall(std::uint32_t seed);
Scene make_ground(std::uint32_t seed);

inline constexpr float kCorridorWidth_m = 2.4f, kCorridorHeight_m = 2.6f, kCorridorLength_m = 30.f;

/// Index of each texture of these scenes in World::textures; 1 is the renderer's fine grain.
enum SceneTexture : int { kBlank, kGrain, kNatural, kFacade, kStreet, kWallpaper, kDoor, kNotices, kCarton };

/// A world with these textures and nothing else.
World empty_world(std::uint32_t seed);

}  // namespace wasp::sim
