// What 16 rays see: the surface's brightness times its texture at the right mipmap level, times a fine grain close up.
// In SIMD, dispatched at run time to the widest instruction set of the machine: rays of one face share everything but
// where they meet it, so a packet costs one pass for each face in it. No fused multiply-adds: every instruction set
// gives the same bits.
#pragma once

#include <cstdint>

#include "sim/world.h"

namespace wasp::sim {

/// Where 16 rays from one eye meet faces.
struct PacketHits {
  alignas(64) float dir_x[16], dir_y[16], dir_z[16];  ///< as cast, NED
  alignas(64) float range[16];                        ///< ray parameter of the hit
  Vec3 eye_ned_m;
  float pixel;  ///< a pixel's width at ray parameter 1 [m]
};

/// Pixel values of the rays in `lanes` (bit i: ray i), which all meet `surface`; the others keep what `out` holds.
/// Realtime-safe: yes.
void shade_lanes(const World& world, const Surface& surface, const PacketHits& hits, std::uint32_t lanes,
                 float* out) noexcept;

/// The same for one ray without SIMD, for tests: `d` as cast, `t` its parameter.
float shade_reference(const World& world, const Surface& surface, const Vec3& o, const Vec3& d, float t, float pixel);

}  // namespace wasp::sim
