// Highway compiles this file once for each instruction set. Rows are padded, so most loops run whole vectors.
#include "vision/kernels/image_shift_bins.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/image_shift_bins.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::shift {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Vec = hn::Vec<Floats>;

HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Floats())); }

/// out[i] = sum over `bin` image rows of one column, 16 bits. Reads exactly `count` pixels a row.
void sum_rows(const std::uint8_t* pixels, std::ptrdiff_t stride, int bin, int count, std::uint16_t* out) {
  const hn::ScalableTag<std::uint16_t> d16;
  const hn::Rebind<std::uint8_t, decltype(d16)> d8;
  const int step = static_cast<int>(hn::Lanes(d16));
  int i = 0;
  for (; i + step <= count; i += step) {
    auto sum = hn::PromoteTo(d16, hn::LoadU(d8, pixels + i));
    for (int r = 1; r < bin; ++r) sum = hn::Add(sum, hn::PromoteTo(d16, hn::LoadU(d8, pixels + r * stride + i)));
    hn::StoreU(sum, d16, out + i);
  }
  for (; i < count; ++i) {
    unsigned sum = 0;
    for (int r = 0; r < bin; ++r) sum += pixels[r * stride + i];
    out[i] = static_cast<std::uint16_t>(sum);
  }
}

/// Sums neighbours in pairs: count values become count / 2, in place.
void sum_pairs(std::uint16_t* values, int count) {
  int i = 0;
#if HWY_TARGET != HWY_SCALAR  // which has no pairs
  const hn::ScalableTag<std::uint16_t> d16;
  const hn::RepartitionToWide<decltype(d16)> d32;
  const hn::Rebind<std::uint16_t, decltype(d32)> half;
  const int step = static_cast<int>(hn::Lanes(d16));
  for (; i + step <= count; i += step) {
    const auto pair = hn::BitCast(d32, hn::LoadU(d16, values + i));
    const auto sum = hn::Add(hn::And(pair, hn::Set(d32, 0xffffu)), hn::ShiftRight<16>(pair));
    hn::StoreU(hn::DemoteTo(half, hn::BitCast(hn::RebindToSigned<decltype(d32)>(), sum)), half, values + i / 2);
  }
#endif
  for (; i + 1 < count; i += 2) values[i / 2] = static_cast<std::uint16_t>(values[i] + values[i + 1]);
}

void to_floats(const std::uint16_t* in, int count, float* out) {
  const Floats d;
  const hn::Rebind<std::uint16_t, Floats> d16;
  const hn::RebindToSigned<Floats> d32;
  int i = 0;
  for (; i + lanes() <= count; i += lanes())
    hn::StoreU(hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(d16, in + i))), d, out + i);
  for (; i < count; ++i) out[i] = in[i];
}

/// Half bins of one image row band: sums of half x half pixels, `count` of them.
void half_bins(const GrayView& image, int x, int y, int half, int count, std::uint16_t* out) {
  int left = count * half;
  sum_rows(image.row(y) + x, image.stride_px, half, left, out);
  for (int b = half; b > 1; b /= 2, left /= 2) sum_pairs(out, left);
}

/// out[i] = (a + 3 b + 3 c + d)[i].
void blend_rows(const std::uint16_t* a, const std::uint16_t* b, const std::uint16_t* c, const std::uint16_t* d,
                int count, std::uint16_t* out) {
  const hn::ScalableTag<std::uint16_t> d16;
  const int step = static_cast<int>(hn::Lanes(d16));
  const auto three = hn::Set(d16, std::uint16_t{3});
  for (int i = 0; i < count; i += step) {  // buffers are padded
    const auto inner = hn::Mul(three, hn::Add(hn::LoadU(d16, b + i), hn::LoadU(d16, c + i)));
    hn::StoreU(hn::Add(hn::Add(hn::LoadU(d16, a + i), hn::LoadU(d16, d + i)), inner), d16, out + i);
  }
}

/// out[i] = in[2i-1] + 3 in[2i] + 3 in[2i+1] + in[2i+2].
void blend_pairs(const std::uint16_t* in, int count, float* out) {
  int i = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::ScalableTag<std::uint32_t> d32;
  const hn::Repartition<std::uint16_t, decltype(d32)> d16;
  const hn::RebindToFloat<decltype(d32)> df;
  const hn::RebindToSigned<decltype(d32)> di;
  const auto low = hn::Set(d32, 0xffffu);
  const int step = static_cast<int>(hn::Lanes(d32));
  for (; i + step <= count; i += step) {
    const auto middle = hn::BitCast(d32, hn::LoadU(d16, in + 2 * i));
    const auto before = hn::BitCast(d32, hn::LoadU(d16, in + 2 * i - 1));
    const auto after = hn::BitCast(d32, hn::LoadU(d16, in + 2 * i + 2));
    const auto inner = hn::Add(hn::And(middle, low), hn::ShiftRight<16>(middle));
    const auto outer = hn::Add(hn::And(before, low), hn::And(after, low));
    const auto sum = hn::Add(hn::Add(inner, inner), hn::Add(inner, outer));
    hn::StoreU(hn::ConvertTo(df, hn::BitCast(di, sum)), df, out + i);
  }
#endif
  for (; i < count; ++i) out[i] = static_cast<float>(in[2 * i - 1] + 3 * (in[2 * i] + in[2 * i + 1]) + in[2 * i + 2]);
}

void BinImage(const GrayView& image, int x, int y, int bin, int rows, int columns, float* out, int pitch) {
  constexpr int kEdge = 64;  // one half bin on either side, and whole vectors past the end
  alignas(64) std::uint16_t ring[4][kMaxSide + 2 * kEdge], blend[kMaxSide + 2 * kEdge];
  if (bin == 1) {
    for (int r = 0; r < rows; ++r) {
      sum_rows(image.row(y + r) + x, image.stride_px, 1, columns, blend);
      to_floats(blend, columns, out + static_cast<std::ptrdiff_t>(r) * pitch);
    }
    return;
  }
  const int half = bin / 2, count = 2 * columns;
  const auto line = [&](int j) { return ring[(j + 4) & 3] + kEdge; };
  const auto fill = [&](int j) {
    const int inside = j < 0 ? 0 : j > 2 * rows - 1 ? 2 * rows - 1 : j;
    half_bins(image, x, y + inside * half, half, count, line(j));
  };
  fill(-1);
  fill(0);
  for (int r = 0; r < rows; ++r) {
    fill(2 * r + 1);
    fill(2 * r + 2);
    std::uint16_t* const mixed = blend + kEdge;
    blend_rows(line(2 * r - 1), line(2 * r), line(2 * r + 1), line(2 * r + 2), count, mixed);
    mixed[-1] = mixed[0];
    mixed[count] = mixed[count - 1];
    blend_pairs(mixed, columns, out + static_cast<std::ptrdiff_t>(r) * pitch);
  }
}

void HalveImage(const float* in, int in_pitch, int rows, int columns, float* out, int pitch) {
  const Floats d;
  for (int r = 0; r < rows; ++r) {
    const float* top = in + static_cast<std::ptrdiff_t>(2 * r) * in_pitch;
    const float* low = top + in_pitch;
    float* o = out + static_cast<std::ptrdiff_t>(r) * pitch;
    for (int c = 0; c < columns; c += lanes()) {
      Vec t0, t1, l0, l1;
      hn::LoadInterleaved2(d, top + 2 * c, t0, t1);
      hn::LoadInterleaved2(d, low + 2 * c, l0, l1);
      hn::StoreU(hn::Add(hn::Add(t0, t1), hn::Add(l0, l1)), d, o + c);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace wasp::vision::shift
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision::shift {

HWY_EXPORT(BinImage);
HWY_EXPORT(HalveImage);

void bin_image(const GrayView& image, int x, int y, int bin, int rows, int columns, float* out, int pitch) noexcept {
  HWY_DYNAMIC_DISPATCH(BinImage)(image, x, y, bin, rows, columns, out, pitch);
}
void halve_image(const float* in, int in_pitch, int rows, int columns, float* out, int pitch) noexcept {
  HWY_DYNAMIC_DISPATCH(HalveImage)(in, in_pitch, rows, columns, out, pitch);
}

}  // namespace wasp::vision::shift
#endif  // HWY_ONCE
