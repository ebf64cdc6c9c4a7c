// What the SIMD loops of flow_grid share: a tile's row is 16 bytes of the image, of which 8 to 10 are used, in one
// 128-bit block; wider vectors hold 2 or 4 rows. Vector k of a tile holds the rows k, k + kSteps, k + 2 kSteps ..., so
// that vector k + 1 is the row below each of them and nothing has to be shifted between blocks.
#if defined(WASP_VISION_KERNELS_FLOW_GRID_ROWS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef WASP_VISION_KERNELS_FLOW_GRID_ROWS_INL_H_
#undef WASP_VISION_KERNELS_FLOW_GRID_ROWS_INL_H_
#else
#define WASP_VISION_KERNELS_FLOW_GRID_ROWS_INL_H_
#endif

#include <algorithm>

// clang-format off
#include <hwy/highway.h>
// clang-format on

#include "vision/kernels/flow_grid_tiles.h"

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR

constexpr int kRowBytes = 16;
constexpr std::size_t kRows = HWY_MAX_BYTES >= 64 ? 4 : HWY_MAX_BYTES >= 32 ? 2 : 1;
constexpr std::size_t kSteps = kTilePx / kRows;

const hn::FixedTag<std::uint8_t, 16 * kRows> kBytes;
const hn::FixedTag<std::int16_t, 8 * kRows> kShorts;
const hn::FixedTag<std::int32_t, 4 * kRows> kInts;
const hn::FixedTag<std::int32_t, 4> kFourInts;
using Bytes = hn::Vec<decltype(kBytes)>;
using Shorts = hn::Vec<decltype(kShorts)>;
using Ints = hn::Vec<decltype(kInts)>;

/// 16 bytes of each of the vector's rows, the first of them at p.
template <std::size_t kCount = kRows>
HWY_INLINE auto load_rows(const std::uint8_t* p, std::ptrdiff_t stride) {
  const hn::FixedTag<std::uint8_t, 16 * kCount> tag;
  if constexpr (kCount == 1) {
    return hn::LoadU(tag, p);
  } else {
    constexpr std::size_t kHalf = kCount / 2;
    constexpr auto kApart = static_cast<std::ptrdiff_t>(kSteps * kHalf);
    return hn::Combine(tag, load_rows<kHalf>(p + kApart * stride, stride), load_rows<kHalf>(p, stride));
  }
}

/// acc + products, summed over a row in no particular order: exact as long as the caller's ranges hold.
HWY_INLINE Ints multiply_add(Shorts a, Shorts b, Ints acc) {
  Ints rest = hn::Zero(kInts);
  acc = hn::ReorderWidenMulAccumulate(kInts, a, b, acc, rest);
  return hn::Add(acc, rest);  // of zeros where the machine adds neighbours itself
}

/// Sums of 4 integers, or more blocks of 4, as one block.
template <class V>
HWY_INLINE auto fold(V x) {
  if constexpr (hn::MaxLanes(hn::DFromV<V>()) <= 4) {
    return x;
  } else {
    const hn::Half<hn::DFromV<V>> half;
    return fold(hn::Add(hn::LowerHalf(half, x), hn::UpperHalf(half, x)));
  }
}

HWY_INLINE void set_part(std::size_t tile, Ints x, TileParts& parts) {
  hn::Store(fold(x), kFourInts, &parts[4 * tile]);
}

/// One float a tile. A tile's integers must not exceed 2^31 each.
HWY_INLINE void sum_parts(const TileParts& parts, float scale, PerTile& out) {
  const hn::CappedTag<std::int32_t, kTileLanes> ints;
  const hn::RebindToFloat<decltype(ints)> floats;
  for (std::size_t t = 0; t < kTileLanes; t += hn::MaxLanes(ints)) {
    hn::Vec<decltype(ints)> a, b, c, d;
    hn::LoadInterleaved4(ints, &parts[4 * t], a, b, c, d);
    const auto ab = hn::Add(hn::ConvertTo(floats, a), hn::ConvertTo(floats, b));
    const auto cd = hn::Add(hn::ConvertTo(floats, c), hn::ConvertTo(floats, d));
    hn::Store(hn::Mul(hn::Add(ab, cd), hn::Set(floats, scale)), floats, &out[t]);
  }
}

#endif

}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
