// flow_grid: a block of tiles is compared with the second image, and the tiles' equations are weighed and summed.
// Vectors are of fixed size, so an SVE machine is served by its NEON half.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/flow_grid_compare.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
// clang-format on

#include "vision/kernels/flow_grid_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

const hn::CappedTag<float, kTileLanes> kTileTag;
const hn::RebindToSigned<decltype(kTileTag)> kTileInts;
constexpr std::size_t kTileStep = hn::MaxLanes(decltype(kTileTag)());

/// Top left corners in the second image: whole pixels, 1/128 parts across and 1/32768 down; u_px < 0 outside.
struct Targets {
  alignas(64) std::array<std::int32_t, kTileLanes> u_px, v_px, u_part, v_part;
};

HWY_INLINE hn::Vec<decltype(kTileTag)> set(float x) { return hn::Set(kTileTag, x); }

HWY_INLINE void aim(const TileBlock& block, const GrayView& second, const CellMotion& m, Targets& out) {
  const auto zero = hn::Zero(kTileTag);
  const auto last_u = set(static_cast<float>(second.width_px - kTilePx));
  const auto last_v = set(static_cast<float>(second.height_px - kTilePx));
  const auto most = hn::Set(kTileInts, 32767), outside = hn::Set(kTileInts, -1);
  for (std::size_t t = 0; t < kTileLanes; t += kTileStep) {
    const auto x = hn::Load(kTileTag, &block.x_px[t]), y = hn::Load(kTileTag, &block.y_px[t]);
    const auto u = hn::Add(hn::Add(hn::Load(kTileTag, &block.corner_u[t]), set(m.u_px)),
                           hn::MulAdd(x, set(m.du_dx), hn::Mul(y, set(m.du_dy))));
    const auto v = hn::Add(hn::Add(hn::Load(kTileTag, &block.corner_v[t]), set(m.v_px)),
                           hn::MulAdd(x, set(m.dv_dx), hn::Mul(y, set(m.dv_dy))));
    const auto inside =
        hn::And(hn::And(hn::Ge(u, zero), hn::Lt(u, last_u)), hn::And(hn::Ge(v, zero), hn::Lt(v, last_v)));
    const auto safe_u = hn::IfThenElseZero(inside, u), safe_v = hn::IfThenElseZero(inside, v);
    const auto whole_u = hn::ConvertTo(kTileInts, safe_u), whole_v = hn::ConvertTo(kTileInts, safe_v);
    const auto part_u = hn::MulAdd(hn::Sub(safe_u, hn::ConvertTo(kTileTag, whole_u)), set(128.f), set(0.5f));
    const auto part_v = hn::Mul(hn::Sub(safe_v, hn::ConvertTo(kTileTag, whole_v)), set(32768.f));
    hn::Store(hn::IfThenElse(hn::RebindMask(kTileInts, inside), whole_u, outside), kTileInts, &out.u_px[t]);
    hn::Store(whole_v, kTileInts, &out.v_px[t]);
    hn::Store(hn::ConvertTo(kTileInts, part_u), kTileInts, &out.u_part[t]);
    hn::Store(hn::Min(hn::ConvertTo(kTileInts, part_v), most), kTileInts, &out.v_part[t]);
  }
}

#if HWY_TARGET == HWY_SCALAR

void compare_tiles(const TileBlock& block, const GrayView& second, const Targets& targets, BlockErrors& e) {
  for (int tile = 0; tile < block.tiles; ++tile) {
    const auto t = static_cast<std::size_t>(tile);
    const bool in = targets.u_px[t] >= 0;
    const TileErrors error = in ? compare_tile_plain(block, tile, second.row(targets.v_px[t]) + targets.u_px[t],
                                                     second.stride_px, targets.u_part[t], targets.v_part[t])
                                : TileErrors{};
    e.bx[t] = error.bx;
    e.by[t] = error.by;
    e.squares[t] = error.squares;
    e.inside[t] = in ? 1.f : 0.f;
  }
}

#else

alignas(16) constexpr std::uint8_t kPairs[16] = {0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8};

/// Neighbouring bytes (i, i + 1), (i + 1, i + 2) ... from `first` on, as 8 pairs in every row.
HWY_INLINE Bytes pairs_from(int first) {
  return hn::Add(hn::LoadDup128(kBytes, kPairs), hn::Set(kBytes, static_cast<std::uint8_t>(first)));
}

/// 128 I between neighbours in a row.
struct AcrossRows {
  Bytes pairs;
  Shorts left, right;  ///< weights, 128 together
  HWY_INLINE Shorts operator()(const std::uint8_t* p, std::ptrdiff_t stride) const {
    const auto both = hn::BitCast(kShorts, hn::TableLookupBytes(load_rows(p, stride), pairs));
    const hn::RebindToUnsigned<decltype(kShorts)> raw;
    const auto low = hn::And(both, hn::Set(kShorts, std::int16_t{0xFF}));
    const auto high = hn::BitCast(kShorts, hn::ShiftRight<8>(hn::BitCast(raw, both)));
    return hn::Add(hn::Mul(low, left), hn::Mul(high, right));
  }
};

enum ComparePart : std::size_t { kBx, kBy, kSquares };

HWY_INLINE void compare_one(const TileBlock& block, std::size_t tile, const std::uint8_t* p, std::ptrdiff_t stride,
                            const AcrossRows& across, int v_part, BlockErrors& e) {
  const auto down = hn::Set(kShorts, static_cast<std::int16_t>(v_part));
  Ints bx = hn::Zero(kInts), by = bx, squares = bx;
  auto row = across(p, stride);
  for (std::size_t k = 0; k < kSteps; ++k) {
    p += stride;
    const auto next = across(p, stride);
    const std::size_t at = tile * kTilePixels + k * 8 * kRows;
    const auto moved = hn::Add(row, hn::MulFixedPoint15(hn::Sub(next, row), down));
    const auto d = hn::Sub(moved, hn::Load(kShorts, &block.gray[at]));
    bx = multiply_add(d, hn::Load(kShorts, &block.gx[at]), bx);
    by = multiply_add(d, hn::Load(kShorts, &block.gy[at]), by);
    const auto small = hn::ShiftRight<2>(d);
    squares = multiply_add(small, small, squares);
    row = next;
  }
  set_part(tile, bx, e.parts[kBx]);
  set_part(tile, by, e.parts[kBy]);
  set_part(tile, squares, e.parts[kSquares]);
}

HWY_INLINE void compare_tiles(const TileBlock& block, const GrayView& second, const Targets& targets, BlockErrors& e) {
  const int last = second.width_px - kRowBytes;
  for (std::size_t t = 0; t < static_cast<std::size_t>(block.tiles); ++t) {
    const bool in = targets.u_px[t] >= 0;
    e.inside[t] = in ? 1.f : 0.f;
    if (!in) {
      set_part(t, hn::Zero(kInts), e.parts[kBx]);
      set_part(t, hn::Zero(kInts), e.parts[kBy]);
      set_part(t, hn::Zero(kInts), e.parts[kSquares]);
      continue;
    }
    const int start = std::min(targets.u_px[t], last);
    const AcrossRows across{pairs_from(targets.u_px[t] - start),
                            hn::Set(kShorts, static_cast<std::int16_t>(128 - targets.u_part[t])),
                            hn::Set(kShorts, static_cast<std::int16_t>(targets.u_part[t]))};
    compare_one(block, t, second.row(targets.v_px[t]) + start, second.stride_px, across, targets.v_part[t], e);
  }
  sum_parts(e.parts[kBx], 1.f / 1024.f, e.bx);
  sum_parts(e.parts[kBy], 1.f / 1024.f, e.by);
  sum_parts(e.parts[kSquares], 1.f / 1024.f, e.squares);
}

#endif

/// How much a tile is believed: falls with the ratio of its squares to what is expected.
HWY_INLINE hn::Vec<decltype(kTileTag)> trust(const TileBlock& block, const BlockErrors& e, std::size_t t) {
  const auto ratio = hn::Mul(hn::Load(kTileTag, &e.squares[t]), hn::Load(kTileTag, &block.per_expected[t]));
  return hn::Div(set(1.f), hn::MulAdd(set(0.5f), ratio, set(1.f)));
}

HWY_INLINE void accumulate(const TileBlock& block, const BlockErrors& e, BlockSums& out) {
  alignas(64) PerTile weight;
  for (std::size_t t = 0; t < kTileLanes; t += kTileStep) {
    const auto believed = trust(block, e, t);
    const auto near = hn::Mul(hn::Load(kTileTag, &block.nearness[t]), hn::Load(kTileTag, &e.inside[t]));
    hn::Store(hn::Mul(hn::Mul(believed, believed), near), kTileTag, &weight[t]);
  }
  const hn::CappedTag<float, 8> tag;
  for (std::size_t k = 0; k < 8; k += hn::MaxLanes(tag)) {
    auto xx = hn::Zero(tag), xy = xx, yy = xx, bu = xx, bv = xx;
    for (std::size_t t = 0; t < static_cast<std::size_t>(block.tiles); ++t) {
      const auto b = hn::Mul(hn::Load(tag, &block.basis[t][k]), hn::Set(tag, weight[t]));
      xx = hn::MulAdd(b, hn::Set(tag, block.hxx[t]), xx);
      xy = hn::MulAdd(b, hn::Set(tag, block.hxy[t]), xy);
      yy = hn::MulAdd(b, hn::Set(tag, block.hyy[t]), yy);
      bu = hn::MulAdd(b, hn::Set(tag, e.bx[t]), bu);
      bv = hn::MulAdd(b, hn::Set(tag, e.by[t]), bv);
    }
    hn::Store(xx, tag, &out.xx[k]);
    hn::Store(xy, tag, &out.xy[k]);
    hn::Store(yy, tag, &out.yy[k]);
    hn::Store(bu, tag, &out.bu[k]);
    hn::Store(bv, tag, &out.bv[k]);
  }
}

void compare(const TileBlock& block, const GrayView& second, const CellMotion& motion, BlockErrors& errors,
             BlockSums& sums) {
  Targets targets;
  aim(block, second, motion, targets);
  compare_tiles(block, second, targets, errors);
  accumulate(block, errors, sums);
}

BlockMatch match(const TileBlock& block, const BlockErrors& e) {
  const auto one = set(1.f), half = set(0.5f);
  auto cost = hn::Zero(kTileTag), total = cost, squares = cost, inside = cost, used = cost;
  for (std::size_t t = 0; t < kTileLanes; t += kTileStep) {
    const auto near = hn::Load(kTileTag, &block.nearness[t]);
    const auto in = hn::IfThenElseZero(hn::Gt(near, hn::Zero(kTileTag)), hn::Load(kTileTag, &e.inside[t]));
    const auto believed = trust(block, e, t);
    cost = hn::MulAdd(near, hn::IfThenElse(hn::Gt(in, half), hn::Sub(one, believed), half), cost);
    used = hn::MulAdd(hn::Mul(near, in), hn::Mul(believed, believed), used);
    squares = hn::MulAdd(near, hn::Load(kTileTag, &e.squares[t]), squares);
    total = hn::Add(total, near);
    inside = hn::Add(inside, in);
  }
  const float all = hn::GetLane(hn::SumOfLanes(kTileTag, total));
  return {hn::GetLane(hn::SumOfLanes(kTileTag, cost)) / all,
          hn::GetLane(hn::SumOfLanes(kTileTag, squares)) / (all * kTilePixels),
          hn::GetLane(hn::SumOfLanes(kTileTag, used)) / all,
          static_cast<int>(hn::GetLane(hn::SumOfLanes(kTileTag, inside)))};
}

}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision {

HWY_EXPORT(compare);
HWY_EXPORT(match);

void compare_block(const TileBlock& block, const GrayView& second, const CellMotion& motion, BlockErrors& errors,
                   BlockSums& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(compare)(block, second, motion, errors, sums);
}

BlockMatch match_of(const TileBlock& block, const BlockErrors& errors) noexcept {
  return HWY_DYNAMIC_DISPATCH(match)(block, errors);
}

}  // namespace wasp::vision
#endif
