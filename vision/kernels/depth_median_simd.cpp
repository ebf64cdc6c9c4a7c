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

/// Values of up to one vector of windows: tap by tap, a lane a window.
struct Taps {
  HWY_ALIGN_MAX std::uint16_t mm[25][hn::MaxLanes(kWords)];
};

HWY_INLINE void gather_window(const DepthView& depth, DepthPixel at, std::size_t lane, Taps& taps) {
  const int u = at.u_px, v = at.v_px;
  if (u >= 2 && v >= 2 && u < depth.width_px - 2 && v < depth.height_px - 2) {
    const std::uint16_t* p = depth.row(v - 2) + u - 2;
    for (std::size_t k = 0; k < 25; k += 5, p += depth.stride_px)
      for (std::size_t j = 0; j < 5; ++j) taps.mm[k + j][lane] = p[j];
  } else if (u >= 0 && v >= 0 && u < depth.width_px && v < depth.height_px) {
    const MedianWindow window = window_at(depth, u, v);
    for (std::size_t k = 0; k < 25; ++k) taps.mm[k][lane] = window.mm[k];
  } else {
    for (auto& tap : taps.mm) tap[lane] = 0;
  }
}

HWY_INLINE Words median_of_valid(const Taps& taps, int min_valid) {
  Words wire[25];
  Words turn = hn::Zero(kWords), invalid_count = turn;
  const Words zero = turn, full = hn::Set(kWords, std::uint16_t{65535});
  for (std::size_t k = 0; k < 25; ++k) {
    const Words mm = hn::Load(kWords, taps.mm[k]);
    const Words invalid = hn::VecFromMask(kWords, hn::Or(hn::Eq(mm, zero), hn::Eq(mm, full)));
    wire[k] = hn::Or(hn::And(invalid, turn), hn::AndNot(invalid, mm));
    turn = hn::Xor(turn, invalid);
    invalid_count = hn::Sub(invalid_count, invalid);
  }
  for (std::size_t column = 0; column < 5; ++column) run_network<kSortFive, 5>(wire + column);
  run_network<kOrderNeighbours>(wire);
  run_network<kMedianOfSortedColumns>(wire);
  const Words most = hn::Set(kWords, static_cast<std::uint16_t>(25 - min_valid));
  const Words enough = hn::VecFromMask(kWords, hn::Eq(hn::SaturatedSub(invalid_count, most), zero));
  return hn::And(wire[kMedianWire], enough);
}

void at_samples(const DepthView& depth, std::span<const DepthPixel> pixels, int min_valid,
                std::span<std::uint16_t> out) {
  const std::size_t lanes = hn::Lanes(kWords);
  Taps taps;
  for (std::size_t begin = 0; begin < pixels.size(); begin += lanes) {
    const std::size_t n = std::min(lanes, pixels.size() - begin);
    for (std::size_t lane = 0; lane < n; ++lane) gather_window(depth, pixels[begin + lane], lane, taps);
    for (std::size_t lane = n; lane < lanes; ++lane) gather_window(depth, {-1, -1}, lane, taps);
    HWY_ALIGN_MAX std::uint16_t result[hn::MaxLanes(kWords)];
    hn::Store(median_of_valid(taps, min_valid), kWords, result);
    std::copy_n(result, n, out.begin() + static_cast<std::ptrdiff_t>(begin));
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
