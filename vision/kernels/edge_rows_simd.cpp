// A block is 2N pixels read as N 16-bit pairs: low and high bytes are the even and odd pixels, so that widening costs
// no shuffle and a block's order (all odd centres, then all even ones) does not matter to sums and counts. Rows of
// 1-2-1 sums are kept in a ring of three; G = newest - oldest. The last block of a row overlaps its neighbour and is
// masked. Each sweep is two loads and some fifteen operations a block.
#include "vision/kernels/edge_rows_simd.h"

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)  // their vectors fit no struct
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/edge_rows_simd.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
// clang-format on

#include <array>

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
#if HWY_TARGET == HWY_SCALAR

std::uint64_t squares_of(const GrayView& image, EdgeKind kind) { return gradient_squares_reference(image, kind); }
void count_of(const EdgeSweep& sweep, EdgeRows& out) { count_rows_reference(sweep, out); }

#else
namespace hn = hwy::HWY_NAMESPACE;

const hn::ScalableTag<std::uint8_t> kBytes;
const hn::ScalableTag<std::int16_t> kShorts;
const hn::ScalableTag<std::uint16_t> kWords;
const hn::ScalableTag<std::int32_t> kInts;
const hn::ScalableTag<std::uint32_t> kUints;
const hn::ScalableTag<std::uint64_t> kLongs;
using Shorts = hn::Vec<decltype(kShorts)>;
using Words = hn::Vec<decltype(kWords)>;
using Ints = hn::Vec<decltype(kInts)>;
using Longs = hn::Vec<decltype(kLongs)>;

/// Values at the odd centres 1, 3, ... and the even centres 2, 4, ... of a block that starts at pixel 0.
struct Block {
  Shorts odd, even;
};

/// Pixels 0, 2, ... / 1, 3, ... / 2, 4, ... / 3, 5, ... from p.
struct Pixels {
  Shorts p0, p1, p2, p3;
};

HWY_INLINE Pixels load_pixels(const std::uint8_t* p) {
  const Words low = hn::Set(kWords, std::uint16_t{0xff});
  const Words a = hn::BitCast(kWords, hn::LoadU(kBytes, p)), b = hn::BitCast(kWords, hn::LoadU(kBytes, p + 2));
  const auto word = [](Words x) HWY_ATTR { return hn::BitCast(kShorts, x); };
  return {word(hn::And(a, low)), word(hn::ShiftRight<8>(a)), word(hn::And(b, low)), word(hn::ShiftRight<8>(b))};
}

/// p[c-1] + 2 p[c] + p[c+1]
HWY_INLINE Block smoothed(const std::uint8_t* p) {
  const Pixels x = load_pixels(p);
  const Shorts middle = hn::Add(x.p1, x.p2);
  return {hn::Add(middle, hn::Add(x.p0, x.p1)), hn::Add(middle, hn::Add(x.p2, x.p3))};
}

HWY_INLINE Block minus(const Block& a, const Block& b) { return {hn::Sub(a.odd, b.odd), hn::Sub(a.even, b.even)}; }
HWY_INLINE Block masked(const Block& a, const Block& m) { return {hn::And(a.odd, m.odd), hn::And(a.even, m.even)}; }

/// One row of 1-2-1 sums, block after block, as `smoothed` orders them.
struct SumRow {
  HWY_ALIGN_MAX std::array<std::int16_t, kMaxEdgeColumns + 128> sums;

  HWY_INLINE Block load(std::size_t at) const {
    return {hn::Load(kShorts, &sums[at]), hn::Load(kShorts, &sums[at + hn::Lanes(kShorts)])};
  }
  HWY_INLINE void store(std::size_t at, const Block& b) {
    hn::Store(b.odd, kShorts, &sums[at]);
    hn::Store(b.even, kShorts, &sums[at + hn::Lanes(kShorts)]);
  }
};

/// How a row of `n` interior pixels is cut: whole blocks, and one more that ends with the row and counts only its end.
struct Cut {
  std::size_t pixels, whole, last_at;  ///< interior pixels a block holds; whole blocks; first pixel of the last one
  bool has_last;
  Block last_mask;
};

HWY_INLINE Cut cut(std::size_t n) {
  const std::size_t lanes = hn::Lanes(kShorts), pixels = 2 * lanes, whole = n / pixels, rest = n % pixels;
  const auto skip = static_cast<std::int16_t>(pixels - rest);  // interior pixels of the last block counted before
  const Shorts index = hn::Iota(kShorts, 0);
  const Shorts twice = hn::Add(index, index), one = hn::Set(kShorts, std::int16_t{1});
  const Shorts before = hn::Set(kShorts, static_cast<std::int16_t>(skip - 1));
  return {
      pixels,
      whole,
      rest == 0 ? 0 : n - pixels,
      rest != 0,
      {hn::VecFromMask(kShorts, hn::Gt(twice, before)), hn::VecFromMask(kShorts, hn::Gt(hn::Add(twice, one), before))}};
}

/// begin(), use(row v, pixel u, vertical gradient) for every block of the row, end(v), rows from the top.
template <class Begin, class Use, class End>
HWY_INLINE void sweep_gradient(const GrayView& image, const Begin& begin, const Use& use, const End& end) {
  const Cut c = cut(static_cast<std::size_t>(image.width_px - 2));
  std::array<SumRow, 3> ring;
  const auto fill = [&](int v, SumRow& row) HWY_ATTR {
    const std::uint8_t* p = image.row(v);
    for (std::size_t b = 0; b < c.whole; ++b) row.store(b * c.pixels, smoothed(p + b * c.pixels));
    if (c.has_last) row.store(c.whole * c.pixels, smoothed(p + c.last_at));
  };
  fill(0, ring[0]);
  fill(1, ring[1]);
  SumRow *oldest = &ring[0], *middle = &ring[1], *newest = &ring[2];
  for (int v = 1; v < image.height_px - 1; ++v) {
    const std::uint8_t* p = image.row(v + 1);
    begin();
    for (std::size_t b = 0; b < c.whole; ++b) {
      const Block s = smoothed(p + b * c.pixels);
      newest->store(b * c.pixels, s);
      use(v, b * c.pixels, minus(s, oldest->load(b * c.pixels)));
    }
    if (c.has_last) {
      const Block s = smoothed(p + c.last_at);
      newest->store(c.whole * c.pixels, s);
      use(v, c.last_at, masked(minus(s, oldest->load(c.whole * c.pixels)), c.last_mask));
    }
    end(v);
    SumRow* const free = oldest;
    oldest = middle;
    middle = newest;
    newest = free;
  }
}

/// Horizontal gradient of the block at pixel u of row v.
HWY_INLINE Block across(const GrayView& image, int v, std::size_t u) {
  const Pixels a = load_pixels(image.row(v - 1) + u), m = load_pixels(image.row(v) + u),
               b = load_pixels(image.row(v + 1) + u);
  const auto column = [](Shorts top, Shorts mid, Shorts low)
                          HWY_ATTR { return hn::Add(hn::Add(top, low), hn::Add(mid, mid)); };
  return {hn::Sub(column(a.p2, m.p2, b.p2), column(a.p0, m.p0, b.p0)),
          hn::Sub(column(a.p3, m.p3, b.p3), column(a.p1, m.p1, b.p1))};
}

/// Adds the squares of a block: pairs of at most 2 x 1,020^2, of a row of 2,046 pixels at most, fit 31 bits.
HWY_INLINE void add_squares(const Block& g, Ints& first, Ints& second) {
  first = hn::ReorderWidenMulAccumulate(kInts, g.odd, g.odd, first, second);
  first = hn::ReorderWidenMulAccumulate(kInts, g.even, g.even, first, second);
}

HWY_INLINE Longs widened(Longs total, Ints row) {
  const Longs pairs = hn::BitCast(kLongs, row);
  return hn::Add(total, hn::Add(hn::ShiftRight<32>(pairs), hn::And(pairs, hn::Set(kLongs, 0xffffffffull))));
}

bool too_narrow(const GrayView& image) noexcept {
  return static_cast<std::size_t>(image.width_px - 2) < 2 * hn::Lanes(kShorts);
}

std::uint64_t squares_of(const GrayView& image, EdgeKind kind) {
  if (too_narrow(image)) return gradient_squares_reference(image, kind);
  Longs total = hn::Zero(kLongs);
  Ints first = hn::Zero(kInts), second = first, third = first, fourth = first;
  const auto begin = [&]() HWY_ATTR { first = second = third = fourth = hn::Zero(kInts); };
  const auto end = [&](int)
                       HWY_ATTR { total = widened(widened(total, hn::Add(first, second)), hn::Add(third, fourth)); };
  if (kind != EdgeKind::kAnyDirection) {
    sweep_gradient(
        image, begin, [&](int, std::size_t, const Block& g) HWY_ATTR { add_squares(g, first, second); }, end);
    return hn::GetLane(hn::SumOfLanes(kLongs, total));
  }
  const Cut c = cut(static_cast<std::size_t>(image.width_px - 2));
  const auto both = [&](int v, std::size_t u, const Block& g) HWY_ATTR {
    const Block gu = across(image, v, u);
    add_squares(g, first, second);
    add_squares(c.has_last && u == c.last_at ? masked(gu, c.last_mask) : gu, third, fourth);
  };
  sweep_gradient(image, begin, both, end);
  return hn::GetLane(hn::SumOfLanes(kLongs, total));
}

/// 1 in every lane where x >= least (both unsigned), `below` being least - 1.
HWY_INLINE Words at_least(Shorts x, Words below) {
  return hn::Min(hn::SaturatedSub(hn::BitCast(kWords, x), below), hn::Set(kWords, std::uint16_t{1}));
}

HWY_INLINE int total_of(Words counts) {
  const auto pairs = hn::BitCast(kUints, counts);
  const auto sums = hn::Add(hn::ShiftRight<16>(pairs), hn::And(pairs, hn::Set(kUints, 0xffffu)));
  return static_cast<int>(hn::GetLane(hn::SumOfLanes(kUints, sums)));
}

/// Depth and limit are moved on the circle of 16 bits, so that one comparison sorts unknown depth (0, 65535) as well:
/// by +1 to the near side, by -1 to the far side.
struct Nearness {
  Words shift, limit;

  HWY_INLINE explicit Nearness(const EdgeSweep& sweep)
      : shift(hn::Set(kWords, static_cast<std::uint16_t>(sweep.mask_unknown ? 65535 : 1))),
        limit(hn::Add(hn::Set(kWords, static_cast<std::uint16_t>(sweep.limit_mm)), shift)) {}
};

/// All ones where the depth of an interior pixel lets its edge count.
HWY_INLINE Block near_enough(const std::uint16_t* mm, std::size_t u, const Nearness& near) {
  const std::size_t lanes = hn::Lanes(kWords);
  const Words low = hn::LoadU(kWords, mm + u + 1), high = hn::LoadU(kWords, mm + u + 1 + lanes);
  const Words zero = hn::Zero(kWords);
  const auto keeps = [&](Words x) HWY_ATTR {
    const auto far = hn::Eq(hn::SaturatedSub(near.limit, hn::Add(x, near.shift)), zero);  // x >= limit
    return hn::BitCast(kShorts, hn::Not(hn::VecFromMask(kWords, far)));
  };
  return {keeps(hn::ConcatEven(kWords, high, low)), keeps(hn::ConcatOdd(kWords, high, low))};
}

/// gu^2 + gv^2 >= least, as 1 or 0 a lane.
HWY_INLINE Words magnitude_at_least(Shorts gu, Shorts gv, Ints below) {
  const auto half = [&](auto u, auto v) HWY_ATTR {
    const Ints wide_u = hn::PromoteTo(kInts, u), wide_v = hn::PromoteTo(kInts, v);
    const Ints square = hn::Add(hn::Mul(wide_u, wide_u), hn::Mul(wide_v, wide_v));
    return hn::VecFromMask(kInts, hn::Gt(square, below));
  };
  const hn::Half<decltype(kShorts)> kHalf;
  const Ints low = half(hn::LowerHalf(kHalf, gu), hn::LowerHalf(kHalf, gv));
  const Ints high = half(hn::UpperHalf(kHalf, gu), hn::UpperHalf(kHalf, gv));
  const Shorts yes = hn::ReorderDemote2To(kShorts, low, high);
  return hn::And(hn::BitCast(kWords, yes), hn::Set(kWords, std::uint16_t{1}));
}

template <class Marks>
HWY_INLINE void count_with(const EdgeSweep& sweep, const Marks& marks, EdgeRows& out) {
  Words counts = hn::Zero(kWords);
  const Nearness near(sweep);
  const auto begin = [&]() HWY_ATTR { counts = hn::Zero(kWords); };
  const auto end = [&](int v) HWY_ATTR { out.count[static_cast<std::size_t>(v)] = total_of(counts); };
  if (sweep.limit_mm > 0) {
    const auto use = [&](int v, std::size_t u, const Block& g) HWY_ATTR {
      const Block keep = near_enough(sweep.depth.row(v), u, near);
      counts = hn::Add(counts, marks(v, u, g, &keep));
    };
    sweep_gradient(sweep.image, begin, use, end);
  } else {
    const auto use = [&](int v, std::size_t u, const Block& g)
                         HWY_ATTR { counts = hn::Add(counts, marks(v, u, g, nullptr)); };
    sweep_gradient(sweep.image, begin, use, end);
  }
}

void count_of(const EdgeSweep& sweep, EdgeRows& out) {
  if (too_narrow(sweep.image)) return count_rows_reference(sweep, out);
  const Words below = hn::Set(kWords, static_cast<std::uint16_t>(sweep.threshold - 1));
  const auto kept = [](const Block& g, const Block* keep) HWY_ATTR { return keep != nullptr ? masked(g, *keep) : g; };
  if (sweep.kind == EdgeKind::kHorizontal) {
    const auto marks = [&](int, std::size_t, const Block& g, const Block* keep) HWY_ATTR {
      const Block k = kept(g, keep);
      return hn::Add(at_least(hn::Abs(k.odd), below), at_least(hn::Abs(k.even), below));
    };
    count_with(sweep, marks, out);
  } else if (sweep.kind == EdgeKind::kBrighterBelow) {
    const Shorts zero = hn::Zero(kShorts);
    const auto marks = [&](int, std::size_t, const Block& g, const Block* keep) HWY_ATTR {
      const Block k = kept(g, keep);
      return hn::Add(at_least(hn::Max(k.odd, zero), below), at_least(hn::Max(k.even, zero), below));
    };
    count_with(sweep, marks, out);
  } else {
    const Cut c = cut(static_cast<std::size_t>(sweep.image.width_px - 2));
    const Ints least = hn::Set(kInts, sweep.threshold * sweep.threshold - 1);
    const auto marks = [&](int v, std::size_t u, const Block& g, const Block* keep) HWY_ATTR {
      Block gu = across(sweep.image, v, u);
      if (c.has_last && u == c.last_at) gu = masked(gu, c.last_mask);
      const Block a = kept(g, keep), b = kept(gu, keep);
      return hn::Add(magnitude_at_least(b.odd, a.odd, least), magnitude_at_least(b.even, a.even, least));
    };
    count_with(sweep, marks, out);
  }
}

#endif
}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision {
namespace {
HWY_EXPORT(squares_of);
HWY_EXPORT(count_of);
}  // namespace

std::uint64_t gradient_squares(const GrayView& image, EdgeKind kind) noexcept {
  return HWY_DYNAMIC_DISPATCH(squares_of)(image, kind);
}
void count_rows(const EdgeSweep& sweep, EdgeRows& out) noexcept { HWY_DYNAMIC_DISPATCH(count_of)(sweep, out); }

}  // namespace wasp::vision
#endif  // HWY_ONCE
