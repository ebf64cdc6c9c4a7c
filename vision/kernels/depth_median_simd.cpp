// Dense, row by row: sort the columns of five into five rows of ranks; merge them by pairs; of two neighbouring pairs
// take the middle six, to which either of two windows adds its fifth column. At samples: gather 25 values of as many
// windows as a vector has lanes, then one network. Invalid values of a sample become 0 and 65535 in
// turn, which leaves the median of the others on the middle wire.
#include "vision/kernels/depth_median_simd.h"

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)  // their vectors fit no array
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/depth_median_simd.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
// clang-format on

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

#include "vision/kernels/depth_median_network.h"
#include "vision/kernels/depth_median_reference.h"

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

const hn::ScalableTag<std::uint16_t> kWords;
using Words = hn::Vec<decltype(kWords)>;

HWY_INLINE void exchange(Words& low, Words& high) {
  const Words smaller = hn::Min(low, high);
  high = hn::Max(low, high);
  low = smaller;
}

/// The network `kList` on wires `wire[low * step]` ...; wires nobody reads later cost nothing once unrolled.
template <const auto& kList, std::size_t kStep, std::size_t... kIndex>
HWY_INLINE void run_network(Words* wire, std::index_sequence<kIndex...>) {
  (exchange(wire[kList[kIndex].low * kStep], wire[kList[kIndex].high * kStep]), ...);
}
template <const auto& kList, std::size_t kStep = 1>
HWY_INLINE void run_network(Words* wire) {
  run_network<kList, kStep>(wire, std::make_index_sequence<kList.size()>{});
}

/// Column 0 of the image lies here in a padded row, so that whole vectors of it are aligned.
constexpr std::size_t kLeft = 64;
/// One row of the image with room on either side for two columns beyond it and a vector's overhang.
using PaddedRow = std::array<std::uint16_t, kLeft + kMaxMedianColumns + 192>;
/// The same for pairs of columns: pair m is the columns 2m - 1 and 2m.
constexpr std::size_t kHalfLeft = 64;
using PairRow = std::array<std::uint16_t, kHalfLeft + kMaxMedianColumns / 2 + 128>;

/// Five ranks of every column about one output row.
struct SortedColumns {
  HWY_ALIGN_MAX std::array<PaddedRow, 5> rank;
};

/// For one output row.
struct Ranks {
  HWY_ALIGN_MAX std::array<PairRow, 5> even, odd;  ///< of the first and second column of every pair
  HWY_ALIGN_MAX std::array<PairRow, 10> merged;    ///< ten ranks of every pair
  HWY_ALIGN_MAX PaddedRow result;
};

/// Calls use(u) for vectors that cover 0 ... n-1; the last one overlaps where n is no multiple. Needs n >= lanes.
template <class Use>
HWY_INLINE void for_each_vector(std::size_t n, const Use& use) {
  const std::size_t lanes = hn::Lanes(kWords);
  for (std::size_t u = 0; u + lanes <= n; u += lanes) use(u);
  if (n % lanes != 0) use(n - lanes);
}

/// Repeats the outermost columns twice on either side.
HWY_INLINE void pad(SortedColumns& columns, std::size_t width) {
  for (PaddedRow& row : columns.rank) {
    row[kLeft - 2] = row[kLeft - 1] = row[kLeft];
    row[kLeft + width] = row[kLeft + width + 1] = row[kLeft + width - 1];
  }
}

/// Inserts `extra` into `four`, which rises, and stores the five.
HWY_INLINE void store_with(const Words* four, Words extra, SortedColumns& columns, std::size_t at) {
  for (std::size_t k = 0; k < 4; ++k) {
    hn::StoreU(hn::Min(four[k], extra), kWords, &columns.rank[k][at]);
    extra = hn::Max(four[k], extra);
  }
  hn::StoreU(extra, kWords, &columns.rank[4][at]);
}

/// For output rows v and v + 1, whose columns share four rows.
HWY_INLINE void sort_columns(const DepthView& depth, int v, SortedColumns& first, SortedColumns& second) {
  const std::uint16_t* rows[6];
  for (int k = 0; k < 6; ++k) rows[k] = depth.row(std::clamp(v + k - 2, 0, depth.height_px - 1));
  const auto width = static_cast<std::size_t>(depth.width_px);
  for_each_vector(width, [&](std::size_t u) HWY_ATTR {
    Words four[4];
    for (std::size_t k = 0; k < 4; ++k) four[k] = hn::LoadU(kWords, rows[k + 1] + u);
    run_network<kSortFour>(four);
    store_with(four, hn::LoadU(kWords, rows[0] + u), first, kLeft + u);
    store_with(four, hn::LoadU(kWords, rows[5] + u), second, kLeft + u);
  });
  pad(first, width);
  pad(second, width);
}

HWY_INLINE void merge_pairs(const SortedColumns& columns, std::size_t pairs, Ranks& ranks) {
  for (std::size_t k = 0; k < 5; ++k) ranks.odd[k][kHalfLeft - 1] = columns.rank[k][kLeft - 2];
  for (std::size_t m = 0; m < pairs; m += hn::Lanes(kWords)) {
    Words wire[10];
    for (std::size_t k = 0; k < 5; ++k) {
      hn::LoadInterleaved2(kWords, &columns.rank[k][kLeft + 2 * m - 1], wire[k], wire[5 + k]);
      hn::StoreU(wire[k], kWords, &ranks.even[k][kHalfLeft + m]);
      hn::StoreU(wire[5 + k], kWords, &ranks.odd[k][kHalfLeft + m]);
    }
    run_network<kMergeFives>(wire);
    for (std::size_t k = 0; k < 10; ++k) hn::StoreU(wire[kMergedFives[k]], kWords, &ranks.merged[k][kHalfLeft + m]);
  }
}

/// The sixth smallest of `middle` (six) and `column` (five), both rising: the least of max(i-th last, i-th).
HWY_INLINE Words median_with(const Words* middle, const PairRow* column, std::size_t at) {
  Words median = middle[5];
  for (std::size_t k = 0; k < 5; ++k)
    median = hn::Min(median, hn::Max(middle[4 - k], hn::LoadU(kWords, &column[k][at])));
  return median;
}

/// Pairs m and m + 1 are in the windows of pixel 2m, with the column before them, and 2m + 1, with the one after.
HWY_INLINE void median_of_two(std::size_t m, Ranks& ranks) {
  Words wire[20], middle[6];
  for (std::size_t k = 0; k < 10; ++k) {
    wire[k] = hn::LoadU(kWords, &ranks.merged[k][kHalfLeft + m]);
    wire[10 + k] = hn::LoadU(kWords, &ranks.merged[k][kHalfLeft + m + 1]);
  }
  run_network<kMiddleOfTens>(wire);
  for (std::size_t k = 0; k < 6; ++k) middle[k] = wire[kMiddle[k]];
  const Words before = median_with(middle, ranks.odd.data(), kHalfLeft + m - 1);
  const Words after = median_with(middle, ranks.even.data(), kHalfLeft + m + 2);
  hn::StoreInterleaved2(before, after, kWords, &ranks.result[kLeft + 2 * m]);
}

void dense(const DepthView& depth, std::uint16_t* out, int out_stride_px) {
  const auto width = static_cast<std::size_t>(depth.width_px);
  if (width < hn::Lanes(kWords)) return median_5x5_reference(depth, out, out_stride_px);
  SortedColumns columns[2] = {};
  Ranks ranks{};
  const std::size_t pairs = (width + 1) / 2;  // of output pixels
  for (int v = 0; v < depth.height_px; ++v, out += out_stride_px) {
    if (v % 2 == 0) sort_columns(depth, v, columns[0], columns[1]);
    merge_pairs(columns[v % 2], pairs + 2, ranks);
    for (std::size_t m = 0; m < pairs; m += hn::Lanes(kWords)) median_of_two(m, ranks);
    std::copy_n(&ranks.result[kLeft], width, out);
  }
}

constexpr bool kLittleEndian = std::endian::native == std::endian::little;

/// Eight values of a row of the image: what a window needs of it, and three more that come along.
const hn::FixedTag<std::uint16_t, 8> kEight;
const hn::Repartition<std::uint8_t, decltype(kEight)> kEightBytes;

/// Windows of as many samples as a vector has lanes, row by row. The window of lane 8 b + i is in slot
/// i * lanes / 8 + b, so that transposing within blocks of eight lanes brings it to its lane.
struct Windows {
  HWY_ALIGN_MAX std::uint16_t row[5][hn::MaxLanes(kWords)][8];
};

/// Which of eight values, of which a window's first column is kShift - 2 before or after the first, its columns are:
/// the outermost is repeated beyond the border.
constexpr auto kShifts = [] {
  std::array<std::array<std::uint8_t, 16>, 8> shifts{};
  for (int shift = 0; shift < 8; ++shift)
    for (int i = 0; i < 16; ++i)
      shifts[static_cast<std::size_t>(shift)][static_cast<std::size_t>(i)] =
          static_cast<std::uint8_t>(2 * std::clamp(shift - 2 + i / 2, 0, 7) + i % 2);
  return shifts;
}();

HWY_INLINE void fetch_at_border(const DepthView& depth, int u, int v, std::size_t slot, Windows& windows) {
  const int left = std::clamp(u - 2, 0, depth.width_px - 8);
  const auto shift = hn::LoadU(kEightBytes, kShifts[static_cast<std::size_t>(u - left)].data());
  for (int k = 0; k < 5; ++k) {
    const auto eight = hn::LoadU(kEight, depth.row(std::clamp(v + k - 2, 0, depth.height_px - 1)) + left);
    const auto shifted = hn::TableLookupBytes(hn::BitCast(kEightBytes, eight), shift);
    hn::Store(hn::BitCast(kEight, shifted), kEight, windows.row[k][slot]);
  }
}

/// A window that is not wholly inside, or has no three values to its right.
HWY_NOINLINE void fetch_special(const DepthView& depth, DepthPixel at, std::size_t slot, Windows& windows) {
  if (at.u_px >= 0 && at.v_px >= 0 && at.u_px < depth.width_px && at.v_px < depth.height_px)
    return fetch_at_border(depth, at.u_px, at.v_px, slot, windows);
  for (auto& row : windows.row) hn::Store(hn::Zero(kEight), kEight, row[slot]);
}

/// Where the windows of `n` pixels begin, as an offset into the image; -1 for special ones and beyond n.
HWY_INLINE void place(const DepthView& depth, const DepthPixel* pixels, std::size_t n, std::int32_t* offsets) {
  const hn::CappedTag<std::int32_t, hn::MaxLanes(kWords)> d;
  constexpr std::size_t kAll = hn::MaxLanes(kWords);
  HWY_ALIGN_MAX std::int32_t packed[kAll];
  static_assert(sizeof(DepthPixel) == sizeof(std::int32_t));
  std::fill_n(packed, kAll, -1);
  std::memcpy(packed, pixels, n * sizeof *pixels);
  const auto one = hn::Set(d, 1), two = hn::Set(d, 2);
  const auto right = hn::Set(d, depth.width_px - 5), bottom = hn::Set(d, depth.height_px - 2);
  const auto stride = hn::Set(d, depth.stride_px);
  for (std::size_t i = 0; i < kAll; i += hn::Lanes(d)) {
    const auto both = hn::Load(d, packed + i);
    const auto first = hn::ShiftRight<16>(hn::ShiftLeft<16>(both)), second = hn::ShiftRight<16>(both);
    const auto &u = kLittleEndian ? first : second, &v = kLittleEndian ? second : first;
    const auto inside = hn::And(hn::And(hn::Gt(u, one), hn::Lt(u, right)), hn::And(hn::Gt(v, one), hn::Lt(v, bottom)));
    const auto offset = hn::Add(hn::Mul(hn::Sub(v, two), stride), hn::Sub(u, two));
    hn::Store(hn::IfThenElse(inside, offset, hn::Set(d, -1)), d, offsets + i);
  }
}

HWY_INLINE void fetch(const DepthView& depth, const DepthPixel* pixels, std::size_t n, Windows& windows) {
  constexpr std::size_t kStep = hn::MaxLanes(kWords) / 8;
  HWY_ALIGN_MAX std::int32_t offsets[8 * kStep];
  place(depth, pixels, n, offsets);
  const std::uint16_t* const data = depth.data;
  const std::ptrdiff_t stride = depth.stride_px;
  for (std::size_t i = 0; i < 8; ++i)
#pragma GCC unroll 8
    for (std::size_t block = 0; block < kStep; ++block) {
      const std::size_t lane = 8 * block + i, slot = i * kStep + block;
      const std::int32_t offset = offsets[lane];
      const std::uint16_t* p = data + offset;
      if (HWY_LIKELY(offset >= 0)) {
#pragma GCC unroll 5
        for (int k = 0; k < 5; ++k) hn::Store(hn::LoadU(kEight, p + k * stride), kEight, windows.row[k][slot]);
      } else {
        fetch_special(depth, lane < n ? pixels[lane] : DepthPixel{-1, -1}, slot, windows);
      }
    }
}

/// One row of the windows to five vectors, one a column.
HWY_INLINE void transpose(const std::uint16_t (*row)[8], Words* column) {
  const hn::RepartitionToWide<decltype(kWords)> d32;
  const hn::RepartitionToWide<decltype(d32)> d64;
  constexpr std::size_t kStep = hn::MaxLanes(kWords) / 8;
  decltype(hn::Zero(d32)) low[4], high[4];
  for (std::size_t i = 0; i < 4; ++i) {
    const Words a = hn::Load(kWords, row[2 * i * kStep]), b = hn::Load(kWords, row[(2 * i + 1) * kStep]);
    low[i] = hn::BitCast(d32, hn::InterleaveLower(kWords, a, b));
    high[i] = hn::BitCast(d32, hn::InterleaveUpper(kWords, a, b));
  }
  const auto lower = [&](auto a, auto b) HWY_ATTR { return hn::BitCast(d64, hn::InterleaveLower(d32, a, b)); };
  const auto upper = [&](auto a, auto b) HWY_ATTR { return hn::BitCast(d64, hn::InterleaveUpper(d32, a, b)); };
  const auto first01 = lower(low[0], low[1]), last01 = lower(low[2], low[3]);
  const auto first23 = upper(low[0], low[1]), last23 = upper(low[2], low[3]);
  column[0] = hn::BitCast(kWords, hn::InterleaveLower(d64, first01, last01));
  column[1] = hn::BitCast(kWords, hn::InterleaveUpper(d64, first01, last01));
  column[2] = hn::BitCast(kWords, hn::InterleaveLower(d64, first23, last23));
  column[3] = hn::BitCast(kWords, hn::InterleaveUpper(d64, first23, last23));
  column[4] = hn::BitCast(kWords, hn::InterleaveLower(d64, lower(high[0], high[1]), lower(high[2], high[3])));
}

/// Invalid values become 0 and 65535 in turn; where all are invalid that leaves 0.
HWY_INLINE Words median_of_valid(const Windows& windows, int min_valid) {
  Words wire[25];
  Words turn = hn::Zero(kWords), invalid_count = turn;
  const Words zero = turn, one = hn::Set(kWords, std::uint16_t{1}), all = hn::Set(kWords, std::uint16_t{65535});
#pragma GCC unroll 5
  for (std::size_t k = 0; k < 5; ++k) transpose(windows.row[k], wire + 5 * k);
#pragma GCC unroll 25
  for (std::size_t k = 0; k < 25; ++k) {
    Words& mm = wire[k];
    const Words next = hn::Add(mm, one);  // 65535 and 0 become 0 and 1
    const auto invalid = hn::Eq(hn::Min(next, one), next);
    mm = hn::IfThenElse(invalid, turn, mm);
    turn = hn::Xor(turn, hn::IfThenElseZero(invalid, all));
    if (min_valid > 1) invalid_count = hn::Add(invalid_count, hn::IfThenElseZero(invalid, one));
  }
  for (std::size_t column = 0; column < 5; ++column) run_network<kSortFive, 5>(wire + column);
  run_network<kOrderNeighbours>(wire);
  run_network<kMedianOfSortedColumns>(wire);
  const Words most = hn::Set(kWords, static_cast<std::uint16_t>(25 - min_valid));
  return hn::IfThenElseZero(hn::Eq(hn::SaturatedSub(invalid_count, most), zero), wire[kMedianWire]);
}

/// A vector's windows are fetched before the vector before it is worked on: by then they have left for the cache, and
/// misses overlap with work.
void at_samples(const DepthView& depth, std::span<const DepthPixel> pixels, int min_valid,
                std::span<std::uint16_t> out) {
  constexpr std::size_t kLanes = hn::MaxLanes(kWords);
  const bool far_apart = static_cast<std::int64_t>(depth.stride_px) * depth.height_px > INT32_MAX;
  if (depth.width_px < 8 || far_apart) return median_5x5_at_reference(depth, pixels, min_valid, out);
  Windows windows[2];
  const auto fetch_from = [&](std::size_t begin) HWY_ATTR {
    if (begin < pixels.size())
      fetch(depth, pixels.data() + begin, std::min(kLanes, pixels.size() - begin), windows[begin / kLanes % 2]);
  };
  fetch_from(0);
  for (std::size_t begin = 0; begin < pixels.size(); begin += kLanes) {
    fetch_from(begin + kLanes);
    HWY_ALIGN_MAX std::uint16_t result[kLanes];
    hn::Store(median_of_valid(windows[begin / kLanes % 2], min_valid), kWords, result);
    std::copy_n(result, std::min(kLanes, pixels.size() - begin), out.begin() + static_cast<std::ptrdiff_t>(begin));
  }
}

}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision {
namespace {
HWY_EXPORT(dense);
HWY_EXPORT(at_samples);
}  // namespace

void median_5x5_simd(const DepthView& depth, std::uint16_t* out, int out_stride_px) noexcept {
  HWY_DYNAMIC_DISPATCH(dense)(depth, out, out_stride_px);
}
void median_5x5_at_simd(const DepthView& depth, std::span<const DepthPixel> pixels, int min_valid,
                        std::span<std::uint16_t> out) noexcept {
  HWY_DYNAMIC_DISPATCH(at_samples)(depth, pixels, min_valid, out);
}

}  // namespace wasp::vision
#endif  // HWY_ONCE
