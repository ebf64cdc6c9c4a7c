// How two images of floats still differ when the second is read where an affine motion says: the sums of one
// Gauss-Newton step, as a SIMD function (Highway picks the widest instruction set the processor has, once, at the first
// call). Realtime-safe: yes.
#pragma once

#include <array>

#include "types/realtime.h"

namespace wasp::vision::shift {

inline constexpr int kMaxAffineSide = 512;

/// Displacement [bins] of the point p = (x, y): (dx + xx x + xy y, dy + yx x + yy y). Points are measured from the
/// middle of the first image in units of half its longer side, so xx ... yy are bins at the edge.
struct Affine {
  float dx = 0, dy = 0, xx = 0, xy = 0, yx = 0, yy = 0;
};

/// Two images of one size, rows padded by 16 floats; the second's values count as gain b + offset.
struct ImagePair {
  const float *first = nullptr, *second = nullptr;
  int pitch = 0, rows = 0, columns = 0;
  float gain = 1, offset = 0;
};

/// Columns and rows of the first image that are compared, and their weights: `columns` of them (padded with zeros to
/// whole vectors) and `rows` of them.
struct Region {
  int column = 0, row = 0, columns = 0, rows = 0;
  const float *weight_x = nullptr, *weight_y = nullptr;
};

/// Weighted sums over every second row of the region. g: gradient of the first image, e: second image (read at the
/// displaced point, bilinear, clamped to the image) less the first.
struct AffineSums {
  std::array<float, 6> gxx{}, gxy{}, gyy{};  ///< gx gx, gx gy, gy gy times 1, x, y, x x, x y, y y
  std::array<float, 3> gxe{}, gye{};         ///< gx e, gy e times 1, x, y
  float ee = 0, weight = 0;                  ///< e e; 1
};

/// The region must keep one column and row away from the first image's border; sides at most kMaxAffineSide.
AffineSums affine_sums(const ImagePair& images, const Region& region, const Affine& motion) WASP_REALTIME;

}  // namespace wasp::vision::shift
