// A part of a world that moves as one piece: its quads are given in a frame of their own, which a piecewise linear path
// carries through the world. A pure function of time, so every camera and every repetition sees the same.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "types/frames.h"

namespace wasp::sim {

/// Where a moving part's frame is: p_world = position + Rz(yaw) p_own.
struct MoverPlace {
  Vec3 position_ned_m = Vec3::Zero();
  float yaw_rad = 0;  ///< about down, clockwise seen from above
};

struct MoverKey {
  float at_s = 0;
  MoverPlace place;
};

struct Mover {
  std::string name;  ///< letters, digits and _: a VRML name
  std::uint32_t first_quad = 0, quad_count = 0;
  std::vector<MoverKey> keys;  ///< at least one; times rise from 0; yaw turns by less than pi from key to key
  bool looped = false;         ///< true: begins again after the last key; false: stays there

  /// Between two keys, linearly. Times before 0 count as 0.
  [[nodiscard]] MoverPlace at(double t_s) const;
};

inline Mat3 R_world_mover(const MoverPlace& place) {
  return Eigen::AngleAxisf(place.yaw_rad, Vec3::UnitZ()).toRotationMatrix();
}

}  // namespace wasp::sim
