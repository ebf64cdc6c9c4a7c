// The textures of the laboratory, painted from noise and a seed.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/texture.h"

namespace wasp::sim {

/// Index of each texture in World::textures.
enum LabTexture : int {
  kFloor,
  kDetail,
  kPlaster,
  kWood,
  kCardboard,
  kBooks,
  kScreen,
  kCeiling,
  kWhiteboard,
  kPlain,
  kLabTextureCount
};

inline constexpr int kFloorTexels = 2048;
inline constexpr double kFloorTexel_m = 0.006;                          ///< 6 mm
inline constexpr double kFloorRepeat_m = kFloorTexels * kFloorTexel_m;  ///< 12.3 m: the floor never repeats

/// A dark patch on the floor where furniture keeps the light away, in floor coordinates (x, y) from the floor's corner.
struct FloorShadow {
  double x_m = 0, y_m = 0, half_x_m = 0, half_y_m = 0;
  double strength = 0.5;  ///< 0 ... 1
};

/// Planks run along y; their borders lie along x as a Poisson process of `edges_per_m`, so that the floor's edge
/// statistics are those of section 7.2 of the thesis with lambda = edges_per_m.
Texture paint_floor(double edges_per_m, const std::vector<FloorShadow>& shadows, std::uint32_t seed);
/// The fine grain that multiplies every texture close up; the renderer expects it as texture 1 of any world.
Texture paint_detail();
/// All textures but the floor, in the order of LabTexture after kFloor.
std::vector<Texture> paint_lab_textures(std::uint32_t seed);

}  // namespace wasp::sim
