// The tile loops of flow_grid in plain C++: the same integers as the SIMD form.
#include "vision/kernels/flow_grid_tiles.h"

namespace wasp::vision {
namespace {

int between(int a, int b, int part) { return a + (((b - a) * part + 16384) >> 15); }

int sample(const std::uint8_t* p, std::ptrdiff_t stride, int u_part, int v_part) {
  return between(between(p[0] << 6, p[1] << 6, u_part), between(p[stride] << 6, p[stride + 1] << 6, u_part), v_part);
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
    out.gray[at] = static_cast<std::int16_t>(*mid << 6);
    out.gx[at] = static_cast<std::int16_t>(gx);
    out.gy[at] = static_cast<std::int16_t>(gy);
    xx += gx * gx;
    xy += gx * gy;
    yy += gy * gy;
    rows += r * (gx * gx + gy * gy);
    columns += (c / 2) * (gx * gx + gy * gy);  // by pairs of columns, as the SIMD form has them
    gray += *mid;
    squares += *mid * *mid;
  }
  const float energy = static_cast<float>(xx + yy);
  out.hxx[t] = static_cast<float>(xx) / 64.f;
  out.hxy[t] = static_cast<float>(xy) / 64.f;
  out.hyy[t] = static_cast<float>(yy) / 64.f;
  out.x_px[t] = energy > 0.f ? 2.f * static_cast<float>(columns) / energy + 0.5f : 3.5f;
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
  return {static_cast<float>(bx) / 512.f, static_cast<float>(by) / 512.f, static_cast<float>(squares) / 256.f};
}

}  // namespace wasp::vision
