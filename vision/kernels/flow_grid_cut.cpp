// flow_grid: a block of tiles is cut from the first image, with its gradients and normal matrices. Vectors are of fixed
// size, so an SVE machine is served by its NEON half.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/flow_grid_cut.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
// clang-format on

#include "vision/kernels/flow_grid_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

template <bool>
void cut_tiles(const GrayView& image, TileBlock& out) {
  out.gray_sum = out.gray_squares = 0;
  for (int t = 0; t < out.tiles; ++t) {
    const auto i = static_cast<std::size_t>(t);
    const std::uint8_t* p = image.row(static_cast<int>(out.corner_v[i])) + static_cast<int>(out.corner_u[i]);
    cut_tile_plain(p, image.stride_px, t, out);
  }
}

#else

/// What is the same for all tiles: where a row's bytes lie, and where its pixels are.
struct CutTables {
  Bytes left, middle, right;  ///< eight bytes from 0, 1 and 2 on, as 16-bit numbers
  Shorts column;
  Ints first_row;  ///< row of a lane in a tile's first vector
};

alignas(16) constexpr std::uint8_t kSpread[16] = {0, 0x80, 1, 0x80, 2, 0x80, 3, 0x80,
                                                  4, 0x80, 5, 0x80, 6, 0x80, 7, 0x80};
alignas(16) constexpr std::int16_t kColumnOf[8] = {0, 1, 2, 3, 4, 5, 6, 7};
alignas(64) constexpr std::int32_t kBlocks[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

HWY_INLINE CutTables make_tables() {
  const auto left = hn::LoadDup128(kBytes, kSpread), one = hn::Set(kBytes, std::uint8_t{1});
  const auto middle = hn::Add(left, one);
  return {left, middle, hn::Add(middle, one), hn::LoadDup128(kShorts, kColumnOf),
          hn::Mul(hn::Load(kInts, kBlocks), hn::Set(kInts, static_cast<std::int32_t>(kSteps)))};
}

/// Rows smoothed (1 2 1) and differentiated (-1 0 1).
struct SobelRows {
  Shorts gray, smooth, slope;
};

HWY_INLINE Shorts twice(Shorts x) { return hn::Add(x, x); }

HWY_INLINE SobelRows sobel_rows(const std::uint8_t* p, std::ptrdiff_t stride, const CutTables& tables, Bytes shift) {
  const auto bytes = load_rows(p, stride);
  const auto left = hn::BitCast(kShorts, hn::TableLookupBytesOr0(bytes, hn::Add(tables.left, shift)));
  const auto middle = hn::BitCast(kShorts, hn::TableLookupBytesOr0(bytes, hn::Add(tables.middle, shift)));
  const auto right = hn::BitCast(kShorts, hn::TableLookupBytesOr0(bytes, hn::Add(tables.right, shift)));
  return {middle, hn::Add(hn::Add(left, right), twice(middle)), hn::Sub(right, left)};
}

enum CutPart : std::size_t { kXx, kXy, kYy, kColumns, kRowsOf };

/// Sums of grey values and of their squares over a block, in parts.
struct Grays {
  Ints sum, squares;
};

HWY_INLINE float sum_of(Ints x) { return static_cast<float>(hn::GetLane(hn::SumOfLanes(kInts, x))); }

/// kGray: the sums of grey values too.
template <bool kGray>
HWY_INLINE void cut_one(const std::uint8_t* p, std::ptrdiff_t stride, const CutTables& tables, Bytes shift,
                        std::size_t tile, TileBlock& out, Grays& grays) {
  Ints xx = hn::Zero(kInts), xy = xx, yy = xx, columns = xx, rows = xx;
  const auto ones = hn::Set(kShorts, std::int16_t{1});
  Ints row = tables.first_row;
  SobelRows above = sobel_rows(p - stride, stride, tables, shift), here = sobel_rows(p, stride, tables, shift);
  for (std::size_t k = 0; k < kSteps; ++k) {
    p += stride;
    const SobelRows below = sobel_rows(p, stride, tables, shift);
    const auto gx = hn::Add(hn::Add(above.slope, below.slope), twice(here.slope));
    const auto gy = hn::Sub(below.smooth, above.smooth);
    const std::size_t at = tile * kTilePixels + k * 8 * kRows;
    hn::Store(hn::ShiftLeft<7>(here.gray), kShorts, &out.gray[at]);
    hn::Store(gx, kShorts, &out.gx[at]);
    hn::Store(gy, kShorts, &out.gy[at]);
    const Ints row_xx = multiply_add(gx, gx, hn::Zero(kInts)), row_yy = multiply_add(gy, gy, hn::Zero(kInts));
    xx = hn::Add(xx, row_xx);
    yy = hn::Add(yy, row_yy);
    xy = multiply_add(gx, gy, xy);
    rows = hn::Add(rows, hn::Mul(row, hn::Add(row_xx, row_yy)));
    columns = multiply_add(gx, hn::Mul(gx, tables.column), multiply_add(gy, hn::Mul(gy, tables.column), columns));
    if constexpr (kGray) {
      grays.sum = multiply_add(here.gray, ones, grays.sum);
      grays.squares = multiply_add(here.gray, here.gray, grays.squares);
    }
    row = hn::Add(row, hn::Set(kInts, 1));
    above = here;
    here = below;
  }
  set_part(tile, xx, out.parts[kXx]);
  set_part(tile, xy, out.parts[kXy]);
  set_part(tile, yy, out.parts[kYy]);
  set_part(tile, columns, out.parts[kColumns]);
  set_part(tile, rows, out.parts[kRowsOf]);
}

/// The centre of a tile's gradient energy from its moments; its middle where it has none.
HWY_INLINE void centre_tiles(TileBlock& out) {
  const hn::CappedTag<float, kTileLanes> tag;
  const auto none = hn::Zero(tag), middle = hn::Set(tag, 3.5f);
  for (std::size_t t = 0; t < kTileLanes; t += hn::MaxLanes(tag)) {
    const auto energy = hn::Add(hn::Load(tag, &out.hxx[t]), hn::Load(tag, &out.hyy[t]));
    const auto some = hn::Gt(energy, none);
    const auto per = hn::Div(hn::Set(tag, 1.f), energy);
    hn::Store(hn::IfThenElse(some, hn::Mul(hn::Load(tag, &out.x_px[t]), per), middle), tag, &out.x_px[t]);
    hn::Store(hn::IfThenElse(some, hn::Mul(hn::Load(tag, &out.y_px[t]), per), middle), tag, &out.y_px[t]);
  }
}

template <bool kGray>
HWY_INLINE void cut_tiles(const GrayView& image, TileBlock& out) {
  const CutTables tables = make_tables();
  Grays grays{hn::Zero(kInts), hn::Zero(kInts)};
  const int last = image.width_px - kRowBytes;
  for (std::size_t t = 0; t < static_cast<std::size_t>(out.tiles); ++t) {
    const int u = static_cast<int>(out.corner_u[t]) - 1, start = std::min(u, last);
    const auto shift = hn::Set(kBytes, static_cast<std::uint8_t>(u - start));
    cut_one<kGray>(image.row(static_cast<int>(out.corner_v[t])) + start, image.stride_px, tables, shift, t, out, grays);
  }
  constexpr float kPerGradient = 1.f / 64.f;  // gradients are 8 times too large
  sum_parts(out.parts[kXx], kPerGradient, out.hxx);
  sum_parts(out.parts[kXy], kPerGradient, out.hxy);
  sum_parts(out.parts[kYy], kPerGradient, out.hyy);
  sum_parts(out.parts[kColumns], kPerGradient, out.x_px);
  sum_parts(out.parts[kRowsOf], kPerGradient, out.y_px);
  if constexpr (kGray) {
    out.gray_sum = sum_of(grays.sum);
    out.gray_squares = sum_of(grays.squares);
  }
  centre_tiles(out);
}

#endif

/// Corners of the block's tiles.
HWY_INLINE void place_tiles(const BlockSite& site, TileBlock& out) {
  out.tiles = 0;
  for (int row = 0; row < site.across; ++row)
    for (int column = 0; column < site.across; ++column) {
      if (site.across == 4 && (row == 0 || row == 3) && (column == 0 || column == 3)) continue;
      const auto t = static_cast<std::size_t>(out.tiles++);
      out.corner_u[t] = static_cast<float>(site.u_px + column * kTilePx);
      out.corner_v[t] = static_cast<float>(site.v_px + row * kTilePx);
    }
}

/// Positions from the cell's centre, nearness, expected errors and the basis of the affine motion.
HWY_INLINE void weigh_tiles(const BlockSite& site, TileBlock& out) {
  constexpr float kReach = 0.1f;  // nearness halves at 0.32 of the block's size
  const hn::CappedTag<float, kTileLanes> tag;
  const float size = static_cast<float>(site.across * kTilePx);
  const auto reach = hn::Set(tag, 1.f / (kReach * size * size)), one = hn::Set(tag, 1.f);
  const auto noise = hn::Set(tag, site.noise_gray * site.noise_gray * kTilePixels);
  const auto slack = hn::Set(tag, site.slack_px * site.slack_px), used = hn::Set(tag, static_cast<float>(out.tiles));
  for (std::size_t t = 0; t < kTileLanes; t += hn::MaxLanes(tag)) {
    const auto x =
        hn::Add(hn::Load(tag, &out.x_px[t]), hn::Sub(hn::Load(tag, &out.corner_u[t]), hn::Set(tag, site.centre_u)));
    const auto y =
        hn::Add(hn::Load(tag, &out.y_px[t]), hn::Sub(hn::Load(tag, &out.corner_v[t]), hn::Set(tag, site.centre_v)));
    const auto near = hn::Div(one, hn::MulAdd(hn::MulAdd(x, x, hn::Mul(y, y)), reach, one));
    const auto texture = hn::Add(hn::Load(tag, &out.hxx[t]), hn::Load(tag, &out.hyy[t]));
    hn::Store(x, tag, &out.x_px[t]);
    hn::Store(y, tag, &out.y_px[t]);
    hn::Store(hn::IfThenElseZero(hn::Lt(hn::Iota(tag, static_cast<float>(t)), used), near), tag, &out.nearness[t]);
    hn::Store(hn::Div(one, hn::MulAdd(slack, texture, noise)), tag, &out.per_expected[t]);
  }
  for (std::size_t t = 0; t < static_cast<std::size_t>(out.tiles); ++t) {
    const float x = out.x_px[t] / kAffineScalePx, y = out.y_px[t] / kAffineScalePx;
    out.basis[t] = {1.f, x, y, x * x, x * y, y * y, 0.f, 0.f};
  }
}

void cut(const GrayView& image, const BlockSite& site, TileBlock& out) {
  place_tiles(site, out);
  if (site.with_gray)
    cut_tiles<true>(image, out);
  else
    cut_tiles<false>(image, out);
  weigh_tiles(site, out);
}

}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision {

HWY_EXPORT(cut);

void cut_block(const GrayView& image, const BlockSite& site, TileBlock& out) noexcept {
  HWY_DYNAMIC_DISPATCH(cut)(image, site, out);
}

}  // namespace wasp::vision
#endif
