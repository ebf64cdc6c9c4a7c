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

#if HWY_TARGET == HWY_SCALAR
HWY_INLINE void blend(const Pairs& pairs, const std::uint16_t* fractions, int n, std::uint8_t* out) {
  for (int i = 0; i < n; ++i) out[i] = remap_blend(pairs.upper[i], pairs.lower[i], fractions[i]);
}
#else
/// `n` is a multiple of kBlock.
HWY_INLINE void blend(const Pairs& pairs, const std::uint16_t* fractions, int n, std::uint8_t* out) {
  constexpr int kBits = kRemapFractionBits;
  const hn::CappedTag<std::int16_t, kBlock> d16;
  const hn::RebindToUnsigned<decltype(d16)> du16;
  const hn::Rebind<std::uint8_t, decltype(d16)> d8;
  const auto low_byte = hn::Set(du16, std::uint16_t{0xff});
  const auto half = hn::Set(d16, std::int16_t{1 << (kBits - 1)});
  const auto across = [&](const std::uint16_t* pair, auto fx) {
    const auto both = hn::Load(du16, pair);
    const auto left = hn::BitCast(d16, hn::And(both, low_byte));
    const auto right = hn::BitCast(d16, hn::ShiftRight<8>(both));
    return hn::Add(hn::ShiftLeft<kBits>(left), hn::Mul(hn::Sub(right, left), fx));
  };
  for (int i = 0; i < n; i += static_cast<int>(hn::Lanes(d16))) {
    const auto fraction = hn::LoadU(du16, fractions + i);
    const auto fx = hn::BitCast(d16, hn::And(fraction, low_byte));
    const auto fy = hn::BitCast(d16, hn::ShiftLeft<15 - kBits>(hn::ShiftRight<8>(fraction)));
    const auto top = across(pairs.upper + i, fx), bottom = across(pairs.lower + i, fx);
    const auto sum = hn::Add(top, hn::MulFixedPoint15(hn::Sub(bottom, top), fy));
    hn::StoreU(hn::DemoteTo(d8, hn::ShiftRight<kBits>(hn::Add(sum, half))), d8, out + i);
  }
}
#endif

void remap_row(const std::uint8_t* source, std::ptrdiff_t stride, const std::uint32_t* offsets,
               const std::uint16_t* fractions, int n, std::uint8_t* out) {
  Pairs pairs;
  int i = 0;
  for (int chunk = 0; i + kBlock <= n; i += chunk) {
    chunk = (n - i < kChunk ? n - i : kChunk) / kBlock * kBlock;
    fetch(source, stride, offsets + i, chunk, pairs);
    blend(pairs, fractions + i, chunk, out + i);
  }
  if (i == n) return;
  if (n < kBlock) {
    for (; i < n; ++i) out[i] = remap_pixel(source + offsets[i], stride, fractions[i]);
    return;
  }
  fetch(source, stride, offsets + n - kBlock, kBlock, pairs);  // the last block overlaps the one before
  blend(pairs, fractions + n - kBlock, kBlock, out + n - kBlock);
}

const char* target_name() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace wasp::vision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

namespace wasp::vision {
namespace {

HWY_EXPORT(remap_row);
HWY_EXPORT(target_name);

/// Runs `row(source, stride, offsets, fractions, n, out)` over the covered part of every output row, clears the rest.
template <class RowFunction>
bool for_rows(const RemapTable& table, const GrayView& source, std::uint8_t* out, int out_stride, RowFunction row) {
  if (!table.fits(source) || out == nullptr || out_stride < table.width_px) return false;
  for (int v = 0; v < table.height_px; ++v) {
    const auto [begin, end] = table.rows[static_cast<std::size_t>(v)];
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(v) * table.width_px + begin;
    std::uint8_t* const line = out + static_cast<std::ptrdiff_t>(v) * out_stride;
    std::memset(line, 0, static_cast<std::size_t>(begin));
    row(source.data, source.stride_px, table.offsets.data() + first, table.fractions.data() + first, end - begin,
        line + begin);
    std::memset(line + end, 0, static_cast<std::size_t>(table.width_px - end));
  }
  return true;
}

/// Asks for the whole source in the order memory likes best: rays ask in the worst one, and a frame just written by
/// another core, or fallen out of the caches, would stall each of them.
void prefetch(const GrayView& source) noexcept {
  constexpr int kLine = 64;
  for (int v = 0; v < source.height_px; ++v)
    for (int u = 0; u < source.width_px; u += kLine) __builtin_prefetch(source.row(v) + u, 0, 2);
}

void remap_row_scalar(const std::uint8_t* source, std::ptrdiff_t stride, const std::uint32_t* offsets,
                      const std::uint16_t* fractions, int n, std::uint8_t* out) noexcept {
  for (int i = 0; i < n; ++i) out[i] = remap_pixel(source + offsets[i], stride, fractions[i]);
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

bool RemapTable::fits(const GrayView& source) const noexcept {
  return !offsets.empty() && source.valid() && source.width_px == source_width_px &&
         source.height_px == source_height_px && source.stride_px == source_stride_px;
}

bool remap(const RemapTable& table, const GrayView& source, std::uint8_t* out, int out_stride) noexcept {
  if (table.fits(source)) prefetch(source);
  return for_rows(table, source, out, out_stride, [](auto... row) noexcept {
    HWY_DYNAMIC_DISPATCH(remap_row)(row...);
  });
}

bool remap_scalar(const RemapTable& table, const GrayView& source, std::uint8_t* out, int out_stride) noexcept {
  return for_rows(table, source, out, out_stride, [](auto... row) noexcept { remap_row_scalar(row...); });
}

const char* remap_target() noexcept { return HWY_DYNAMIC_DISPATCH(target_name)(); }

}  // namespace wasp::vision
#endif  // HWY_ONCE
