// The inner loops of flow_grid on tiles of 8 x 8 pixels, in 16-bit fixed point. A block is a square of tiles; each tile
// is compared with the second image at its own sub-pixel offset and gives its own 2 x 2 normal equation, so that a
// block may follow an affine motion, lose the tiles that leave the image, and down-weight those that move otherwise.
// Grey values are kept as 128 I, gradients (Sobel) as 8 dI/dx; sums over a tile are exact 32-bit integers.
#pragma once

#include <array>
#include <cstdint>

#include "types/image_view.h"
#include "types/realtime.h"

namespace wasp::vision {

inline constexpr int kTilePx = 8;
inline constexpr int kTilePixels = kTilePx * kTilePx;
inline constexpr int kMaxTiles = 12;           ///< 4 x 4 without its corners
inline constexpr int kTileLanes = 16;          ///< room for tiles in arrays that are gone through by vectors
inline constexpr float kAffineScalePx = 16.f;  ///< positions and affine unknowns are per 16 px in the equations
inline constexpr int kMinTileImagePx = 26;     ///< least side of an image that takes a block of 3 x 3 tiles

/// Affine motion of a cell at one level: a point x moves by shift + gradient (x - centre).
struct CellMotion {
  float u_px = 0, v_px = 0;  ///< shift of the cell's centre
  float du_dx = 0, du_dy = 0, dv_dx = 0, dv_dy = 0;
};

using PerTile = std::array<float, kTileLanes>;
/// Four parts of a tile's sum; those of tiles that do not exist stay what they were, harmlessly.
using TileParts = std::array<std::int32_t, 4 * kTileLanes>;

/// A block of the first image. Unused tiles have nearness 0. The rows of a tile lie in an order of the machine's own.
struct TileBlock {
  int tiles = 0;
  alignas(64) std::array<std::int16_t, kMaxTiles * kTilePixels> gray, gx, gy;
  alignas(64) PerTile hxx{}, hxy{}, hyy{};         ///< normal matrix of a tile [grey^2/px^2]
  alignas(64) PerTile corner_u{}, corner_v{};      ///< top left pixel of a tile
  alignas(64) PerTile x_px{}, y_px{};              ///< centre of its gradient energy, from the cell's centre
  alignas(64) PerTile nearness{}, per_expected{};  ///< weight by distance; 1 / expected sum of squares
  alignas(64) std::array<std::array<float, 8>, kMaxTiles> basis;  ///< 1, x, y, xx, xy, yy of scaled positions, 0, 0
  float gray_sum = 0, gray_squares = 0;                           ///< of the block's pixels, where wanted
  alignas(64) std::array<TileParts, 5> parts{};                   ///< scratch
};

/// Where a block is cut, and what its tiles are expected to differ by.
struct BlockSite {
  int u_px = 0, v_px = 0;  ///< top left pixel; the block and a border of one pixel must lie in the image
  float centre_u = 0, centre_v = 0;
  bool with_gray = true;   ///< whether the sums of grey values are wanted
  int across = 4;          ///< tiles a side: 3 (nine tiles), or 4 (twelve: the corners are left out)
  float noise_gray = 3.f;  ///< one sigma of an aligned difference
  float slack_px = 0.1f;   ///< and of misalignment inside the block
};

/// A block compared at one motion: sums of gradient times difference, of squares, and 1 where a tile lay inside.
struct BlockErrors {
  alignas(64) PerTile bx{}, by{}, squares{}, inside{};
  alignas(64) std::array<TileParts, 3> parts{};  ///< scratch
};

/// Sums over a block at one motion: the basis weighted by nearness and trust.
struct BlockSums {
  alignas(32) std::array<float, 8> xx, xy, yy, bu, bv;
};

struct BlockMatch {
  float cost = 1;     ///< 0 ... 1: share of the block that does not match
  float squares = 0;  ///< mean squared difference [grey^2]
  float trust = 0;    ///< 0 ... 1: mean weight of the tiles in the sums, beside their nearness
  int inside = 0;     ///< tiles that lie in the second image
};

/// Realtime-safe: yes, as all of this file.
void cut_block(const GrayView& image, const BlockSite& site, TileBlock& out) WASP_REALTIME;

/// Compares every tile with `second` where `motion` puts it. A tile counts as outside unless it lies in the image with
/// one pixel to spare on the right and below; it is not read then.
void compare_block(const TileBlock& block, const GrayView& second, const CellMotion& motion, BlockErrors& errors,
                   BlockSums& sums) WASP_REALTIME;
BlockMatch match_of(const TileBlock& block, const BlockErrors& errors) WASP_REALTIME;

/// One tile of each in plain loops, for machines without SIMD and for tests; the same integers.
/// `p` is the tile's top left pixel. Sets hxx, hxy, hyy, x_px and y_px (from that pixel); adds to gray_sum and
/// gray_squares.
void cut_tile_plain(const std::uint8_t* p, std::ptrdiff_t stride, int tile, TileBlock& out) WASP_REALTIME;
struct TileErrors {
  float bx = 0, by = 0, squares = 0;  ///< sums of gradient times difference [grey^2/px] and of squares [grey^2]
};
/// Parts of a pixel are in 1/128 (u) and 1/32768 (v).
TileErrors compare_tile_plain(const TileBlock& block, int tile, const std::uint8_t* p, std::ptrdiff_t stride,
                              int u_part, int v_part) WASP_REALTIME;

}  // namespace wasp::vision
