// Bilinear by table: the horizontal blend of upper and lower row in Q7 (at most 255 * 128, which fits 15 bits), the
// vertical one as a rounded Q15 product of their difference. All in 16-bit lanes.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/log_polar_remap.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "vision/kernels/log_polar_remap.h"

#ifndef WASP_REMAP_BLEND
#define WASP_REMAP_BLEND
namespace wasp::vision {
/// One output pixel from its upper and lower pair of neighbours: what every target must reproduce to the bit.
inline std::uint8_t remap_blend(std::uint16_t upper, std::uint16_t lower, std::uint16_t fractions) noexcept {
  constexpr int kBits = kRemapFractionBits;
  const int fx = fractions & 0xff, fy = fractions >> 8;
  const auto across = [fx](int pair) { return ((pair & 0xff) << kBits) + ((pair >> 8) - (pair & 0xff)) * fx; };
  const int top = across(upper), bottom = across(lower);
  const int sum = top + (((bottom - top) * (fy << (15 - kBits)) + (1 << 14)) >> 15);
  return static_cast<std::uint8_t>((sum + (1 << (kBits - 1))) >> kBits);
}
/// Two neighbours in a row; the left one in the low byte on the little-endian machines this is built for.
inline std::uint16_t remap_pair(const std::uint8_t* p) noexcept {
  std::uint16_t pair;
  __builtin_memcpy(&pair, p, sizeof pair);
  return pair;
}
inline std::uint8_t remap_pixel(const std::uint8_t* p, std::ptrdiff_t stride, std::uint16_t fractions) noexcept {
  return remap_blend(remap_pair(p), remap_pair(p + stride), fractions);
}
/// Whether the near columns of this row are all covered, and so done beforehand.
inline bool has_near(const RemapTable& table, int v) noexcept {
  const auto [begin, end] = table.rows[static_cast<std::size_t>(v)];
  return table.near.columns > 0 && begin == 0 && end >= table.near.columns;
}
}  // namespace wasp::vision
#endif

HWY_BEFORE_NAMESPACE();
namespace wasp::vision {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kChunk = 256;  ///< pixels fetched before they are blended: by then the stores have left for the cache
constexpr int kBlock = 32;   ///< widest vector of 16-bit lanes used

/// Upper and lower pair of neighbours of each pixel.
struct Pairs {
  alignas(64) std::uint16_t upper[kChunk];
  alignas(64) std::uint16_t lower[kChunk];
};

HWY_INLINE void fetch(const std::uint8_t* source, std::ptrdiff_t stride, const std::uint32_t* offsets, int n,
                      Pairs& pairs) {
#pragma GCC unroll 8
  for (int i = 0; i < n; ++i) {
    pairs.upper[i] = remap_pair(source + offsets[i]);
    pairs.lower[i] = remap_pair(source + offsets[i] + stride);
  }
}

const hn::CappedTag<std::int16_t, kBlock> kShorts;
const hn::RebindToUnsigned<decltype(kShorts)> kWords;
using Shorts = hn::Vec<decltype(kShorts)>;
using Words = hn::Vec<decltype(kWords)>;

HWY_INLINE Shorts low_bytes(Words pairs) {
  return hn::BitCast(kShorts, hn::And(pairs, hn::Set(kWords, std::uint16_t{0xff})));
}
HWY_INLINE Shorts high_bytes(Words pairs) { return hn::BitCast(kShorts, hn::ShiftRight<8>(pairs)); }

/// Blends one vector of pixels from their neighbours: upper left, upper right, lower left, lower right.
HWY_INLINE void blend(Shorts ul, Shorts ur, Shorts ll, Shorts lr, const std::uint16_t* fractions, std::uint8_t* out) {
  constexpr int kBits = kRemapFractionBits;
  const hn::Rebind<std::uint8_t, decltype(kShorts)> d8;
  const Words fraction = hn::LoadU(kWords, fractions);
  const Shorts fx = low_bytes(fraction);
  const Shorts fy = hn::BitCast(kShorts, hn::ShiftLeft<15 - kBits>(hn::ShiftRight<8>(fraction)));
  const auto across = [&fx](Shorts left, Shorts right)
                          HWY_ATTR { return hn::Add(hn::ShiftLeft<kBits>(left), hn::Mul(hn::Sub(right, left), fx)); };
  const Shorts top = across(ul, ur), bottom = across(ll, lr);
  const Shorts sum = hn::Add(top, hn::MulFixedPoint15(hn::Sub(bottom, top), fy));
  const Shorts half = hn::Set(kShorts, std::int16_t{1 << (kBits - 1)});
  hn::StoreU(hn::DemoteTo(d8, hn::ShiftRight<kBits>(hn::Add(sum, half))), d8, out);
}

/// Left pair and right pair of each pixel of the near columns.
struct Fours {
  alignas(64) std::uint16_t both[2 * kChunk];
};

/// Some pixels of one output row, a multiple of kBlock.
struct Piece {
  const std::uint16_t* fractions = nullptr;
  std::uint8_t* out = nullptr;
  int n = 0;
};

HWY_INLINE void blend(const Pairs& pairs, const Piece& piece) {
  for (int i = 0; i < piece.n; i += static_cast<int>(hn::Lanes(kShorts))) {
    const Words upper = hn::Load(kWords, pairs.upper + i), lower = hn::Load(kWords, pairs.lower + i);
    blend(low_bytes(upper), high_bytes(upper), low_bytes(lower), high_bytes(lower), piece.fractions + i, piece.out + i);
  }
}
HWY_INLINE void blend(const Fours& fours, const Piece& piece) {
  for (int i = 0; i < piece.n; i += static_cast<int>(hn::Lanes(kShorts))) {
    Words left, right;
    hn::LoadInterleaved2(kWords, fours.both + 2 * i, left, right);
    blend(low_bytes(left), low_bytes(right), high_bytes(left), high_bytes(right), piece.fractions + i, piece.out + i);
  }
}

/// Every piece is fetched before the piece before it is blended: by then its stores have left for the cache.
template <class Fetched>
class Pipeline {
 public:
  template <class Fetch>
  HWY_INLINE void push(const Piece& piece, const Fetch& fetch) {
    fetch(fetched_[turn_]);
    turn_ ^= 1;
    flush();
    waiting_ = piece;
  }
  HWY_INLINE void flush() {
    blend(fetched_[turn_], waiting_);
    waiting_.n = 0;
  }
  HWY_INLINE void finish() {
    turn_ ^= 1;
    flush();
  }

 private:
  Fetched fetched_[2];
  Piece waiting_;
  int turn_ = 0;
};

/// All columns of all rows, without the near ones where `near_done`.
void far_columns(const RemapTable& table, const GrayView& source, std::uint8_t* out, int out_stride, bool near_done) {
  Pipeline<Pairs> pipeline;
  for (int v = 0; v < table.height_px; ++v) {
    const auto [first, end] = table.rows[static_cast<std::size_t>(v)];
    const int begin = near_done && has_near(table, v) ? table.near.columns : first;
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(v) * table.width_px;
    const std::uint32_t* const offsets = table.offsets.data() + row;
    const std::uint16_t* const fractions = table.fractions.data() + row;
    std::uint8_t* const line = out + static_cast<std::ptrdiff_t>(v) * out_stride;
    const auto push = [&](int u, int n) HWY_ATTR {
      pipeline.push({fractions + u, line + u, n},
                    [&](Pairs& pairs) HWY_ATTR { fetch(source.data, source.stride_px, offsets + u, n, pairs); });
    };
    if (end - begin < kBlock) {
      for (int u = begin; u < end; ++u) line[u] = remap_pixel(source.data + offsets[u], source.stride_px, fractions[u]);
      continue;
    }
    for (int u = begin, n = 0; u < end; u += n) {
      u = u < end - kBlock ? u : end - kBlock;  // the last block overlaps the one before
      n = (end - u < kChunk ? end - u : kChunk) / kBlock * kBlock;
      push(u, n);
    }
  }
  pipeline.finish();
}

/// The near columns of rows begin ... end-1 from `window`, which has pairs (pixel, pixel below).
void near_columns(const RemapTable& table, const std::uint16_t* window, int begin, int end, std::uint8_t* out,
                  int out_stride) {
  Pipeline<Fours> pipeline;
  for (int v = begin; v < end; ++v) {
    if (!has_near(table, v)) continue;
    const std::uint16_t* const offsets =
        table.near.offsets.data() + static_cast<std::ptrdiff_t>(v) * table.near.columns;
    const std::uint16_t* const fractions = table.fractions.data() + static_cast<std::ptrdiff_t>(v) * table.width_px;
    std::uint8_t* const line = out + static_cast<std::ptrdiff_t>(v) * out_stride;
    for (int u = 0, n = 0; u < table.near.columns; u += n) {
      n = table.near.columns - u < kChunk ? table.near.columns - u : kChunk;
      pipeline.push({fractions + u, line + u, n}, [&](Fours& fours) HWY_ATTR {
#pragma GCC unroll 8
        for (int i = 0; i < n; ++i) {
          std::uint32_t four;
          __builtin_memcpy(&four, window + offsets[u + i], sizeof four);
          asm("" : "+r"(four));  // or gcc puts a vector together in registers, which takes half as long again
          __builtin_memcpy(fours.both + 2 * i, &four, sizeof four);
        }
      });
    }
  }
  pipeline.finish();
}

/// Pairs (upper, lower) of two rows of bytes; either has `n`.
void pair_rows(const std::uint8_t* upper, const std::uint8_t* lower, int n, std::uint16_t* out) {
  const hn::CappedTag<std::uint8_t, 2 * kBlock> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int i = 0;
  for (; i + lanes <= n; i += lanes)
    hn::StoreInterleaved2(hn::LoadU(d, upper + i), hn::LoadU(d, lower + i), d,
                          reinterpret_cast<std::uint8_t*>(out + i));
  for (; i < n; ++i) out[i] = static_cast<std::uint16_t>(upper[i] | lower[i] << 8);
}

const char* target_name() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace wasp::vision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

namespace wasp::vision {
namespace {

HWY_EXPORT(far_columns);
HWY_EXPORT(near_columns);
HWY_EXPORT(pair_rows);
HWY_EXPORT(target_name);

/// Zeros what the table does not cover.
void clear_rest(const RemapTable& table, std::uint8_t* out, int out_stride) noexcept {
  for (int v = 0; v < table.height_px; ++v) {
    const auto [begin, end] = table.rows[static_cast<std::size_t>(v)];
    std::uint8_t* const line = out + static_cast<std::ptrdiff_t>(v) * out_stride;
    if (begin > 0) std::memset(line, 0, static_cast<std::size_t>(begin));
    if (end < table.width_px) std::memset(line + end, 0, static_cast<std::size_t>(table.width_px - end));
  }
}

bool usable(const RemapTable& table, const GrayView& source, const std::uint8_t* out, int out_stride) noexcept {
  return table.fits(source) && out != nullptr && out_stride >= table.width_px;
}

/// Asks for what is read of rows begin ... end-1 of the source in the order memory likes best: rays ask in the worst
/// one, and a frame just written by another core, or fallen out of the caches, would stall each of them.
void prefetch(const RemapTable& table, const GrayView& source, int begin, int end) noexcept {
  constexpr int kLine = 64;
  for (int v = begin; v < end; ++v) {
    const auto [first, last] = table.source_rows[static_cast<std::size_t>(v)];
    for (int u = first; u < last + kLine; u += kLine)
      __builtin_prefetch(source.row(v) + std::min(u, source.width_px - 1), 0, 2);
  }
}

/// The near columns of all rows; meanwhile the rest of the source comes nearer.
void remap_near(const RemapTable& table, const GrayView& source, std::uint8_t* out, int out_stride) noexcept {
  const RemapTable::Near& near = table.near;
  alignas(64) std::array<std::uint16_t, kRemapNearPixels> window;
  for (int v = 0; v < near.height_px; ++v) {
    const std::uint8_t* upper = source.row(near.y_px + v) + near.x_px;
    HWY_DYNAMIC_DISPATCH(pair_rows)
    (upper, upper + source.stride_px, near.width_px, &window[static_cast<std::size_t>(v * near.width_px)]);
  }
  constexpr int kSlice = 16;  // output rows between two helpings of the source
  for (int v = 0; v < table.height_px; v += kSlice) {
    const int end = std::min(v + kSlice, table.height_px);
    prefetch(table, source, v * source.height_px / table.height_px, end * source.height_px / table.height_px);
    HWY_DYNAMIC_DISPATCH(near_columns)(table, window.data(), v, end, out, out_stride);
  }
}

}  // namespace

void RemapTable::reset(int out_width, int out_height, int source_width, int source_height, int source_stride) {
  const auto bad = [](int size) { return size < 2 || size > kRemapMaxSize; };
  if (bad(out_width) || bad(out_height) || bad(source_width) || bad(source_height) || bad(source_stride) ||
      source_stride < source_width)
    throw std::invalid_argument("remap table: cannot map " + std::to_string(source_width) + "x" +
                                std::to_string(source_height) + " (stride " + std::to_string(source_stride) + ") to " +
                                std::to_string(out_width) + "x" + std::to_string(out_height));
  *this = RemapTable{};
  width_px = out_width, height_px = out_height;
  source_width_px = source_width, source_height_px = source_height, source_stride_px = source_stride;
  const auto pixels = static_cast<std::size_t>(out_width) * static_cast<std::size_t>(out_height);
  offsets.assign(pixels, 0u);
  fractions.assign(pixels, std::uint16_t{0});
  rows.assign(static_cast<std::size_t>(out_height), Row{});
}

void RemapTable::set(int column, int row, double x_px, double y_px) {
  constexpr int kOne = 1 << kRemapFractionBits;
  const auto fixed = [](double at, int size) {
    const int value = static_cast<int>(std::lround(std::clamp(at, 0.0, size - 1.0) * kOne));
    return std::min(value, (size - 1) * kOne - 1);  // the last pixel is reached to within 1/128
  };
  const int x = fixed(x_px, source_width_px), y = fixed(y_px, source_height_px);
  const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(column);
  offsets[at] = static_cast<std::uint32_t>((y / kOne) * source_stride_px + x / kOne);
  fractions[at] = static_cast<std::uint16_t>((x % kOne) | ((y % kOne) << 8));
}

RemapTable::Corner RemapTable::upper_left(std::size_t row, int column) const {
  const auto at = row * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(column);
  const auto offset = static_cast<int>(offsets[at]);
  return {offset % source_stride_px, offset / source_stride_px};
}

void RemapTable::finish() {
  find_source_rows();
  find_near();
}

void RemapTable::find_source_rows() {
  source_rows.assign(static_cast<std::size_t>(source_height_px), {source_width_px, 0});
  for (std::size_t v = 0; v < rows.size(); ++v)
    for (int u = rows[v].begin; u < rows[v].end; ++u) {
      const auto [x, y] = upper_left(v, u);
      for (const int read : {y, y + 1}) {
        Row& row = source_rows[static_cast<std::size_t>(read)];
        row = {std::min(row.begin, x), std::max(row.end, x + 2)};
      }
    }
}

void RemapTable::find_near() {
  constexpr int kStep = 32;
  int left = source_width_px, top = source_height_px, right = 0, bottom = 0;  // of upper left neighbours
  near = {};
  if (std::any_of(rows.begin(), rows.end(), [](const Row& row) { return row.begin > 0; })) return;
  for (int columns = kStep; columns <= width_px; columns += kStep) {
    for (std::size_t v = 0; v < rows.size(); ++v)
      for (int u = std::max(columns - kStep, rows[v].begin); u < std::min(columns, rows[v].end); ++u) {
        const auto [x, y] = upper_left(v, u);
        left = std::min(left, x), right = std::max(right, x), top = std::min(top, y), bottom = std::max(bottom, y);
      }
    const int width = right - left + 2, height = bottom - top + 1;
    if (right < left || width * height > kRemapNearPixels) break;
    near = {.x_px = left, .y_px = top, .width_px = width, .height_px = height, .columns = columns, .offsets = {}};
  }
  for (std::size_t v = 0; v < rows.size(); ++v)
    for (int u = 0; u < near.columns; ++u) {
      const auto [x, y] = upper_left(v, u);
      const bool covered = u >= rows[v].begin && u < rows[v].end;
      near.offsets.push_back(static_cast<std::uint16_t>(covered ? (y - near.y_px) * near.width_px + x - near.x_px : 0));
    }
}

bool RemapTable::fits(const GrayView& source) const noexcept {
  return !offsets.empty() && source.valid() && source.width_px == source_width_px &&
         source.height_px == source_height_px && source.stride_px == source_stride_px;
}

bool remap(const RemapTable& table, const GrayView& source, std::uint8_t* out, int out_stride) noexcept {
  if (!usable(table, source, out, out_stride)) return false;
  const bool near = table.near.columns > 0;
  if (near)
    remap_near(table, source, out, out_stride);
  else
    prefetch(table, source, 0, source.height_px);
  HWY_DYNAMIC_DISPATCH(far_columns)(table, source, out, out_stride, near);
  clear_rest(table, out, out_stride);
  return true;
}

bool remap_scalar(const RemapTable& table, const GrayView& source, std::uint8_t* out, int out_stride) noexcept {
  if (!usable(table, source, out, out_stride)) return false;
  clear_rest(table, out, out_stride);
  for (int v = 0; v < table.height_px; ++v) {
    const auto [begin, end] = table.rows[static_cast<std::size_t>(v)];
    for (int u = begin; u < end; ++u) {
      const auto at =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(table.width_px) + static_cast<std::size_t>(u);
      out[static_cast<std::ptrdiff_t>(v) * out_stride + u] =
          remap_pixel(source.data + table.offsets[at], source.stride_px, table.fractions[at]);
    }
  }
  return true;
}

const char* remap_target() noexcept { return HWY_DYNAMIC_DISPATCH(target_name)(); }

}  // namespace wasp::vision
#endif  // HWY_ONCE
