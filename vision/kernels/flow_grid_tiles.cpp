#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/flow_grid_tiles.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
// clang-format on
#include <algorithm>

#include "vision/kernels/flow_grid_tiles.h"

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

void cut_one(const std::uint8_t* p, std::ptrdiff_t stride, int tile, TileBlock& out) {
  cut_tile_plain(p, stride, tile, out);
}

TileErrors compare_one(const TileBlock& block, int tile, const std::uint8_t* p, std::ptrdiff_t stride, int u_part,
                       int v_part) {
  return compare_tile_plain(block, tile, p, stride, u_part, v_part);
}

#else

const hn::FixedTag<std::uint8_t, 8> kBytes;
const hn::FixedTag<std::int16_t, 8> kShorts;
const hn::FixedTag<std::int32_t, 4> kInts;
const hn::FixedTag<float, 4> kFloats;
using Shorts = hn::Vec<decltype(kShorts)>;
using Ints = hn::Vec<decltype(kInts)>;

HWY_INLINE Shorts load8(const std::uint8_t* p) { return hn::PromoteTo(kShorts, hn::LoadU(kBytes, p)); }

/// acc + pairwise products: exact as long as the caller's ranges hold.
HWY_INLINE Ints multiply_add(Shorts a, Shorts b, Ints acc) {
  Ints rest = hn::Zero(kInts);
  acc = hn::ReorderWidenMulAccumulate(kInts, a, b, acc, rest);
  return hn::Add(acc, rest);
}

HWY_INLINE Shorts twice(Shorts x) { return hn::Add(x, x); }

HWY_INLINE float sum(Ints x) { return hn::GetLane(hn::SumOfLanes(kFloats, hn::ConvertTo(kFloats, x))); }

/// A row smoothed (1 2 1) and differentiated (-1 0 1).
struct SobelRow {
  Shorts gray, smooth, slope;
};

HWY_INLINE SobelRow sobel_row(const std::uint8_t* p) {
  const auto left = load8(p - 1), middle = load8(p), right = load8(p + 1);
  return {middle, hn::Add(hn::Add(left, right), twice(middle)), hn::Sub(right, left)};
}

void cut_one(const std::uint8_t* p, std::ptrdiff_t stride, int tile, TileBlock& out) {
  const auto t = static_cast<std::size_t>(tile);
  Ints xx = hn::Zero(kInts), xy = xx, yy = xx, rows = xx, sum_i = xx, sum_ii = xx;
  const auto ones = hn::Set(kShorts, std::int16_t{1});
  SobelRow above = sobel_row(p - stride), row = sobel_row(p);
  for (int r = 0; r < kTilePx; ++r) {
    p += stride;
    const SobelRow below = sobel_row(p);
    const auto gx = hn::Add(hn::Add(above.slope, below.slope), twice(row.slope));
    const auto gy = hn::Sub(below.smooth, above.smooth);
    const std::size_t at = t * kTilePixels + static_cast<std::size_t>(r * kTilePx);
    hn::Store(hn::ShiftLeft<6>(row.gray), kShorts, &out.gray[at]);
    hn::Store(gx, kShorts, &out.gx[at]);
    hn::Store(gy, kShorts, &out.gy[at]);
    xx = multiply_add(gx, gx, xx);
    yy = multiply_add(gy, gy, yy);
    xy = multiply_add(gx, gy, xy);
    rows = hn::Add(rows, hn::Add(xx, yy));  // running sum: the row moment, counted from the bottom
    sum_i = multiply_add(row.gray, ones, sum_i);
    sum_ii = multiply_add(row.gray, row.gray, sum_ii);
    above = row;
    row = below;
  }
  const auto energies = hn::ConvertTo(kFloats, hn::Add(xx, yy));
  const float energy = hn::GetLane(hn::SumOfLanes(kFloats, energies));
  const float columns = hn::GetLane(hn::SumOfLanes(kFloats, hn::Mul(energies, hn::Iota(kFloats, 0.f))));
  out.hxx[t] = sum(xx) / 64.f;
  out.hyy[t] = sum(yy) / 64.f;
  out.hxy[t] = sum(xy) / 64.f;
  out.x_px[t] = energy > 0.f ? 2.f * columns / energy + 0.5f : 3.5f;
  out.y_px[t] = energy > 0.f ? static_cast<float>(kTilePx) - sum(rows) / energy : 3.5f;
  out.gray_sum += sum(sum_i);
  out.gray_squares += sum(sum_ii);
}

/// Between a and b, both 64 I, at 1/32768 parts.
HWY_INLINE Shorts between(Shorts a, Shorts b, Shorts part) {
  return hn::Add(a, hn::MulFixedPoint15(hn::Sub(b, a), part));
}

HWY_INLINE Shorts row_between(const std::uint8_t* p, Shorts part) {
  return between(hn::ShiftLeft<6>(load8(p)), hn::ShiftLeft<6>(load8(p + 1)), part);
}

#if HWY_MAX_BYTES >= 32

/// Two rows in one vector.
const hn::FixedTag<std::uint8_t, 16> kBytes2;
const hn::FixedTag<std::int16_t, 16> kShorts2;
const hn::FixedTag<std::int32_t, 8> kInts2;
using Shorts2 = hn::Vec<decltype(kShorts2)>;
using Ints2 = hn::Vec<decltype(kInts2)>;

HWY_INLINE Shorts2 load_rows(const std::uint8_t* p, std::ptrdiff_t stride) {
  const auto both = hn::Combine(kBytes2, hn::LoadU(kBytes, p + stride), hn::LoadU(kBytes, p));
  return hn::ShiftLeft<6>(hn::PromoteTo(kShorts2, both));
}

HWY_INLINE Shorts2 between2(Shorts2 a, Shorts2 b, Shorts2 part) {
  return hn::Add(a, hn::MulFixedPoint15(hn::Sub(b, a), part));
}

HWY_INLINE Shorts2 rows_between(const std::uint8_t* p, std::ptrdiff_t stride, Shorts2 part) {
  return between2(load_rows(p, stride), load_rows(p + 1, stride), part);
}

HWY_INLINE Ints2 multiply_add2(Shorts2 a, Shorts2 b, Ints2 acc) {
  Ints2 rest = hn::Zero(kInts2);
  acc = hn::ReorderWidenMulAccumulate(kInts2, a, b, acc, rest);
  return hn::Add(acc, rest);
}

HWY_INLINE float sum2(Ints2 x) { return sum(hn::Add(hn::LowerHalf(kInts, x), hn::UpperHalf(kInts, x))); }

HWY_INLINE TileErrors compare_one(const TileBlock& block, int tile, const std::uint8_t* p, std::ptrdiff_t stride,
                                  int u_part, int v_part) {
  const auto u = hn::Set(kShorts2, static_cast<std::int16_t>(u_part));
  const auto v = hn::Set(kShorts2, static_cast<std::int16_t>(v_part));
  const Shorts2 rows01 = rows_between(p, stride, u), rows23 = rows_between(p + 2 * stride, stride, u);
  const Shorts2 rows45 = rows_between(p + 4 * stride, stride, u), rows67 = rows_between(p + 6 * stride, stride, u);
  const Shorts row8 = row_between(p + 8 * stride, hn::LowerHalf(kShorts, u));
  const Shorts2 rows12 = hn::ConcatLowerUpper(kShorts2, rows23, rows01);
  const Shorts2 rows34 = hn::ConcatLowerUpper(kShorts2, rows45, rows23);
  const Shorts2 rows56 = hn::ConcatLowerUpper(kShorts2, rows67, rows45);
  const Shorts2 rows78 = hn::Combine(kShorts2, row8, hn::UpperHalf(kShorts, rows67));
  Ints2 bx = hn::Zero(kInts2), by = bx, squares = bx;
  std::size_t at = static_cast<std::size_t>(tile) * kTilePixels;
  const auto add = [&](Shorts2 moved) HWY_ATTR {
    const auto d = hn::Sub(moved, hn::Load(kShorts2, &block.gray[at]));
    bx = multiply_add2(d, hn::Load(kShorts2, &block.gx[at]), bx);
    by = multiply_add2(d, hn::Load(kShorts2, &block.gy[at]), by);
    const auto small = hn::ShiftRight<2>(d);
    squares = multiply_add2(small, small, squares);
    at += 2 * kTilePx;
  };
  add(between2(rows01, rows12, v));
  add(between2(rows23, rows34, v));
  add(between2(rows45, rows56, v));
  add(between2(rows67, rows78, v));
  return {sum2(bx) / 512.f, sum2(by) / 512.f, sum2(squares) / 256.f};
}

#else

HWY_INLINE TileErrors compare_one(const TileBlock& block, int tile, const std::uint8_t* p, std::ptrdiff_t stride,
                                  int u_part, int v_part) {
  const auto u = hn::Set(kShorts, static_cast<std::int16_t>(u_part));
  const auto v = hn::Set(kShorts, static_cast<std::int16_t>(v_part));
  const std::size_t start = static_cast<std::size_t>(tile) * kTilePixels;
  Ints bx = hn::Zero(kInts), by = bx, squares = bx;
  auto row = row_between(p, u);
  for (std::size_t at = start; at < start + kTilePixels; at += kTilePx) {
    p += stride;
    const auto next = row_between(p, u);
    const auto d = hn::Sub(between(row, next, v), hn::Load(kShorts, &block.gray[at]));
    bx = multiply_add(d, hn::Load(kShorts, &block.gx[at]), bx);
    by = multiply_add(d, hn::Load(kShorts, &block.gy[at]), by);
    const auto small = hn::ShiftRight<2>(d);
    squares = multiply_add(small, small, squares);
    row = next;
  }
  return {sum(bx) / 512.f, sum(by) / 512.f, sum(squares) / 256.f};
}

#endif

#endif

const hn::CappedTag<float, kMaxTiles> kTileTag;
const hn::RebindToSigned<decltype(kTileTag)> kTileInts;
constexpr std::size_t kStep = hn::MaxLanes(decltype(kTileTag)());

void cut(const GrayView& image, const BlockSite& site, TileBlock& out) {
  out.across = site.across;
  out.gray_sum = out.gray_squares = 0;
  for (int t = 0; t < out.tiles(); ++t) {
    const int u = site.u_px + t % site.across * kTilePx, v = site.v_px + t / site.across * kTilePx;
    out.corner_u[static_cast<std::size_t>(t)] = static_cast<float>(u);
    out.corner_v[static_cast<std::size_t>(t)] = static_cast<float>(v);
    cut_one(image.row(v) + u, image.stride_px, t, out);
  }
  const float size = static_cast<float>(site.across * kTilePx);
  const auto reach = hn::Set(kTileTag, 1.f / (0.32f * size * size)), one = hn::Set(kTileTag, 1.f);
  const auto noise = hn::Set(kTileTag, site.noise_gray * site.noise_gray * kTilePixels);
  const auto slack = hn::Set(kTileTag, site.slack_px * site.slack_px);
  const auto used = hn::Set(kTileTag, static_cast<float>(out.tiles()));
  for (std::size_t t = 0; t < kMaxTiles; t += kStep) {
    const auto x = hn::Add(hn::Load(kTileTag, &out.x_px[t]),
                           hn::Sub(hn::Load(kTileTag, &out.corner_u[t]), hn::Set(kTileTag, site.centre_u)));
    const auto y = hn::Add(hn::Load(kTileTag, &out.y_px[t]),
                           hn::Sub(hn::Load(kTileTag, &out.corner_v[t]), hn::Set(kTileTag, site.centre_v)));
    const auto square = hn::Add(hn::Mul(x, x), hn::Mul(y, y));
    const auto near = hn::Div(one, hn::Add(one, hn::Mul(square, reach)));
    const auto texture = hn::Add(hn::Load(kTileTag, &out.hxx[t]), hn::Load(kTileTag, &out.hyy[t]));
    hn::Store(x, kTileTag, &out.x_px[t]);
    hn::Store(y, kTileTag, &out.y_px[t]);
    hn::Store(hn::IfThenElseZero(hn::Lt(hn::Iota(kTileTag, static_cast<float>(t)), used), near), kTileTag,
              &out.nearness[t]);
    hn::Store(hn::Div(one, hn::Add(noise, hn::Mul(slack, texture))), kTileTag, &out.per_expected[t]);
  }
}

/// Top left corners in the second image: whole pixels and 1/32768 parts; u_px < 0 outside.
struct Targets {
  alignas(64) std::array<std::int32_t, kMaxTiles> u_px, v_px, u_part, v_part;
};

HWY_INLINE hn::Vec<decltype(kTileTag)> set(float x) { return hn::Set(kTileTag, x); }

HWY_INLINE void aim(const TileBlock& block, const GrayView& second, const CellMotion& m, Targets& out) {
  const auto zero = hn::Zero(kTileTag), parts = set(32768.f);
  const auto last_u = set(static_cast<float>(second.width_px - kTilePx));
  const auto last_v = set(static_cast<float>(second.height_px - kTilePx));
  const auto most = hn::Set(kTileInts, 32767), outside = hn::Set(kTileInts, -1);
  for (std::size_t t = 0; t < kMaxTiles; t += kStep) {
    const auto x = hn::Load(kTileTag, &block.x_px[t]), y = hn::Load(kTileTag, &block.y_px[t]);
    const auto u = hn::Add(hn::Add(hn::Load(kTileTag, &block.corner_u[t]), set(m.u_px)),
                           hn::Add(hn::Mul(x, set(m.du_dx)), hn::Mul(y, set(m.du_dy))));
    const auto v = hn::Add(hn::Add(hn::Load(kTileTag, &block.corner_v[t]), set(m.v_px)),
                           hn::Add(hn::Mul(x, set(m.dv_dx)), hn::Mul(y, set(m.dv_dy))));
    const auto inside =
        hn::And(hn::And(hn::Ge(u, zero), hn::Lt(u, last_u)), hn::And(hn::Ge(v, zero), hn::Lt(v, last_v)));
    const auto safe_u = hn::IfThenElseZero(inside, u), safe_v = hn::IfThenElseZero(inside, v);
    const auto whole_u = hn::ConvertTo(kTileInts, safe_u), whole_v = hn::ConvertTo(kTileInts, safe_v);
    const auto part_u = hn::Mul(hn::Sub(safe_u, hn::ConvertTo(kTileTag, whole_u)), parts);
    const auto part_v = hn::Mul(hn::Sub(safe_v, hn::ConvertTo(kTileTag, whole_v)), parts);
    hn::Store(hn::IfThenElse(hn::RebindMask(kTileInts, inside), whole_u, outside), kTileInts, &out.u_px[t]);
    hn::Store(whole_v, kTileInts, &out.v_px[t]);
    hn::Store(hn::Min(hn::ConvertTo(kTileInts, part_u), most), kTileInts, &out.u_part[t]);
    hn::Store(hn::Min(hn::ConvertTo(kTileInts, part_v), most), kTileInts, &out.v_part[t]);
  }
}

/// Tiles' errors, and 1 where a tile was inside.
struct Errors {
  alignas(64) PerTile bx{}, by{}, squares{}, inside{};
  alignas(64) PerTile weight;
};

/// Trust falls with the ratio of squares to their expectation; outside the image it is half and the weight nothing.
HWY_INLINE void weigh(const TileBlock& block, Errors& e, BlockSums& out) {
  const auto one = hn::Set(kTileTag, 1.f), half = hn::Set(kTileTag, 0.5f);
  auto cost = hn::Zero(kTileTag), total = cost, squares = cost, inside = cost;
  for (std::size_t t = 0; t < kMaxTiles; t += kStep) {
    const auto near = hn::Load(kTileTag, &block.nearness[t]), in = hn::Load(kTileTag, &e.inside[t]);
    const auto square = hn::Load(kTileTag, &e.squares[t]);
    const auto ratio = hn::Mul(square, hn::Load(kTileTag, &block.per_expected[t]));
    const auto trust = hn::Div(one, hn::Add(one, hn::Mul(half, ratio)));
    const auto lost = hn::IfThenElse(hn::Gt(in, half), hn::Sub(one, trust), half);
    hn::Store(hn::Mul(hn::Mul(trust, trust), hn::Mul(near, in)), kTileTag, &e.weight[t]);
    cost = hn::Add(cost, hn::Mul(near, lost));
    squares = hn::Add(squares, hn::Mul(near, square));
    total = hn::Add(total, near);
    inside = hn::Add(inside, in);
  }
  const float all = hn::GetLane(hn::SumOfLanes(kTileTag, total));
  out.cost = hn::GetLane(hn::SumOfLanes(kTileTag, cost)) / all;
  out.squares = hn::GetLane(hn::SumOfLanes(kTileTag, squares)) / (all * kTilePixels);
  out.inside = static_cast<int>(hn::GetLane(hn::SumOfLanes(kTileTag, inside)));
}

const hn::CappedTag<float, 8> kBasisTag;
constexpr std::size_t kBasisStep = hn::MaxLanes(decltype(kBasisTag)());

HWY_INLINE void accumulate(const TileBlock& block, const Errors& e, BlockSums& out) {
  alignas(64) std::array<std::array<float, 8>, kMaxTiles> basis;
  const auto tiles = static_cast<std::size_t>(block.tiles());
  for (std::size_t t = 0; t < tiles; ++t) {
    const float w = e.weight[t], x = block.x_px[t] / kAffineScalePx, y = block.y_px[t] / kAffineScalePx;
    const float wx = w * x, wy = w * y;
    basis[t] = {w, wx, wy, wx * x, wx * y, wy * y, 0.f, 0.f};
  }
  for (std::size_t k = 0; k < 8; k += kBasisStep) {
    auto xx = hn::Zero(kBasisTag), xy = xx, yy = xx, bu = xx, bv = xx;
    for (std::size_t t = 0; t < tiles; ++t) {
      const auto b = hn::Load(kBasisTag, &basis[t][k]);
      xx = hn::MulAdd(b, hn::Set(kBasisTag, block.hxx[t]), xx);
      xy = hn::MulAdd(b, hn::Set(kBasisTag, block.hxy[t]), xy);
      yy = hn::MulAdd(b, hn::Set(kBasisTag, block.hyy[t]), yy);
      bu = hn::MulAdd(b, hn::Set(kBasisTag, e.bx[t]), bu);
      bv = hn::MulAdd(b, hn::Set(kBasisTag, e.by[t]), bv);
    }
    hn::Store(xx, kBasisTag, &out.xx[k]);
    hn::Store(xy, kBasisTag, &out.xy[k]);
    hn::Store(yy, kBasisTag, &out.yy[k]);
    hn::Store(bu, kBasisTag, &out.bu[k]);
    hn::Store(bv, kBasisTag, &out.bv[k]);
  }
}

void compare(const TileBlock& block, const GrayView& second, const CellMotion& motion, BlockSums& out) {
  Targets targets;
  Errors e;
  aim(block, second, motion, targets);
  for (std::size_t t = 0; t < static_cast<std::size_t>(block.tiles()); ++t) {
    if (targets.u_px[t] < 0) continue;
    const std::uint8_t* p = second.row(targets.v_px[t]) + targets.u_px[t];
    const TileErrors error =
        compare_one(block, static_cast<int>(t), p, second.stride_px, targets.u_part[t], targets.v_part[t]);
    e.bx[t] = error.bx;
    e.by[t] = error.by;
    e.squares[t] = error.squares;
    e.inside[t] = 1.f;
  }
  weigh(block, e, out);
  accumulate(block, e, out);
}

}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision {

HWY_EXPORT(cut);
HWY_EXPORT(compare);
HWY_EXPORT(compare_one);

void cut_block(const GrayView& image, const BlockSite& site, TileBlock& out) noexcept {
  HWY_DYNAMIC_DISPATCH(cut)(image, site, out);
}

void compare_block(const TileBlock& block, const GrayView& second, const CellMotion& motion, BlockSums& out) noexcept {
  HWY_DYNAMIC_DISPATCH(compare)(block, second, motion, out);
}

TileErrors compare_tile(const TileBlock& block, int tile, const std::uint8_t* p, std::ptrdiff_t stride, int u_part,
                        int v_part) noexcept {
  return HWY_DYNAMIC_DISPATCH(compare_one)(block, tile, p, stride, u_part, v_part);
}

}  // namespace wasp::vision
#endif
