// A laboratory: 12 m x 10 m plank floor, walls with windows, door and whiteboard, benches with monitors, chairs,
// shelves, a rack, cartons. Same seed, same room. The vehicle starts at the origin, facing +x; nothing stands within
// 2.2 m of it.
#pragma once

#include <cstdint>

#include "sim/world.h"

namespace wasp::sim {

struct LabOptions {
  std::uint32_t seed = 1;
  double edges_per_m = 3.1;  ///< lambda of the floor's edges along x; the thesis' indoor value (7.2)
  int cartons = 9;           ///< scattered over the floor, 0 ... 40
};

inline constexpr float kLabMinX_m = -4, kLabMaxX_m = 8, kLabMinY_m = -5, kLabMaxY_m = 5, kLabHeight_m = 3;
inline constexpr float kLabFreeRadius_m = 2.2f;

World make_lab(const LabOptions& options);

}  // namespace wasp::sim
