// The tile loops of flow_grid in plain C++: the same integers as the SIMD form.
#include <algorithm>
#include <cstdlib>

#include "vision/kernels/flow_grid_centre.h"
#include "vision/kernels/flow_grid_tiles.h"

namespace wasp::vision {
namespace {

int across(const std::uint8_t* p, int u_part) { return p[0] * (128 - u_part) + p[1] * u_part; }

/// 128 I between four pixels.
int sample(const std::uint8_t* p, std::ptrdiff_t stride, int u_part, int v_part) {
  const int above = across(p, u_part), below = across(p + stride, u_part);
  return above + (((below - above) * v_part + 16384) >> 15);
}

}  // namespace

void cut_tile_plain(const std::uint8_t* p, std::ptrdiff_t stride, int tile, TileBlock& out) noexcept {
  const auto t = static_cast<std::size_t>(tile);
  std::int64_t xx = 0, xy = 0, yy = 0, rows = 0, columns = 0, gray = 0, squares = 0;
  for (int i = 0; i < kTilePixels; ++i) {
    const int r = i / kTilePx, c = i % kTilePx;
    const std::uint8_t *mid = p + r * stride + c, *up = mid - stride, *down = mid + stride;
    const int gx = up[1] + 2 * mid[1] + down[1] - up[-1] - 2 * mid[-1] - down[-1];
    const int gy = down[-1] + 2 * down[0] + down[1] - up[-1] - 2 * up[0] - up[1];
    const std::size_t at = t * kTilePixels + static_cast<std::size_t>(i);
    out.gray[at] = static_cast<std::int16_t>(*mid << 7);
    out.gx[at] = static_cast<std::int16_t>(gx);
    out.gy[at] = static_cast<std::int16_t>(gy);
    xx += gx * gx;
    xy += gx * gy;
    yy += gy * gy;
    rows += r * (gx * gx + gy * gy);
    columns += c * (gx * gx + gy * gy);
    gray += *mid;
    squares += *mid * *mid;
  }
  const float energy = static_cast<float>(xx + yy);
  out.hxx[t] = static_cast<float>(xx) / 64.f;
  out.hxy[t] = static_cast<float>(xy) / 64.f;
  out.hyy[t] = static_cast<float>(yy) / 64.f;
  out.x_px[t] = energy > 0.f ? static_cast<float>(columns) / energy : 3.5f;
  out.y_px[t] = energy > 0.f ? static_cast<float>(rows) / energy : 3.5f;
  out.gray_sum += static_cast<float>(gray);
  out.gray_squares += static_cast<float>(squares);
}

TileErrors compare_tile_plain(const TileBlock& block, int tile, const std::uint8_t* p, std::ptrdiff_t stride,
                              int u_part, int v_part) noexcept {
  std::int64_t bx = 0, by = 0, squares = 0;
  for (int i = 0; i < kTilePixels; ++i) {
    const std::size_t at = static_cast<std::size_t>(tile * kTilePixels + i);
    const int d = sample(p + i / kTilePx * stride + i % kTilePx, stride, u_part, v_part) - block.gray[at];
    bx += d * block.gx[at];
    by += d * block.gy[at];
    squares += (d >> 2) * (d >> 2);
  }
  return {static_cast<float>(bx) / 1024.f, static_cast<float>(by) / 1024.f, static_cast<float>(squares) / 1024.f};
}

int centre_sum_plain(const CentrePatch& patch) noexcept {
  int sum = 0;
  for (int v = 0; v < kCentreHeightPx; ++v)
    for (int u = 0; u < kCentreWidthPx; ++u) {
      const int moved =
          sample(patch.moved + v * patch.moved_stride + u, patch.moved_stride, patch.u_part, patch.v_part);
      sum += std::min(std::abs(moved - 128 * patch.still[v * patch.still_stride + u]), 128 * kCentreMostGray);
    }
  return sum;
}

}  // namespace wasp::vision
