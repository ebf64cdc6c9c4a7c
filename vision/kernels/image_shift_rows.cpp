// Highway compiles this file once for each instruction set. Rows are padded, so loops run whole vectors and only
// reductions mask their tail.
#include "vision/kernels/image_shift_rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/image_shift_rows.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::shift {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Vec = hn::Vec<Floats>;

HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Floats())); }
HWY_INLINE float total(Vec v) { return hn::GetLane(hn::SumOfLanes(Floats(), v)); }

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

float WeightedSum(const float* image, int pitch, int rows, int columns, const float* wx, const float* wy) {
  const Floats d;
  Vec sum = hn::Zero(d);
  for (int r = 0; r < rows; ++r) {
    const float* row = image + static_cast<std::ptrdiff_t>(r) * pitch;
    Vec line = hn::Zero(d);
    for (int c = 0; c < columns; c += lanes()) line = hn::MulAdd(hn::LoadU(d, row + c), hn::LoadU(d, wx + c), line);
    sum = hn::MulAdd(line, hn::Set(d, wy[r]), sum);
  }
  return total(sum);
}

void PackPair(const float* a, const float* b, int pitch, int rows, int columns, float mean_a, float mean_b,
              const float* wx, const float* wy, std::complex<float>* z, int z_rows, int z_columns) {
  const Floats d;
  const Vec ma = hn::Set(d, mean_a), mb = hn::Set(d, mean_b);
  for (int r = 0; r < rows; ++r) {
    const float *ra = a + static_cast<std::ptrdiff_t>(r) * pitch, *rb = b + static_cast<std::ptrdiff_t>(r) * pitch;
    auto* out = reinterpret_cast<float*>(z + static_cast<std::ptrdiff_t>(r) * z_columns);
    const Vec w = hn::Set(d, wy[r]);
    int c = 0;
    for (; c + lanes() <= z_columns; c += lanes()) {
      const Vec weight = hn::Mul(w, hn::LoadU(d, wx + c));
      hn::StoreInterleaved2(hn::Mul(weight, hn::Sub(hn::LoadU(d, ra + c), ma)),
                            hn::Mul(weight, hn::Sub(hn::LoadU(d, rb + c), mb)), d, out + 2 * c);
    }
    for (; c < z_columns; ++c) {
      out[2 * c] = wy[r] * wx[c] * (ra[c] - mean_a);
      out[2 * c + 1] = wy[r] * wx[c] * (rb[c] - mean_b);
    }
  }
  auto* rest = reinterpret_cast<float*>(z + static_cast<std::ptrdiff_t>(rows) * z_columns);
  const std::ptrdiff_t left = 2 * static_cast<std::ptrdiff_t>(z_rows - rows) * z_columns;
  for (std::ptrdiff_t i = 0; i < left; ++i) rest[i] = 0.f;
  (void)columns;
}

/// H of one column pair, with z = Z[v][u] = p + jq and m = Z[-v][-u] = s + jt.
struct Cross {
  Vec re, im, first, second;
};
HWY_INLINE Cross cross(Vec p, Vec q, Vec s, Vec t) {
  const Vec r1 = hn::Add(p, s), i1 = hn::Sub(q, t), r2 = hn::Add(q, t), i2 = hn::Sub(s, p);
  return {hn::MulAdd(r2, r1, hn::Mul(i2, i1)), hn::NegMulAdd(r2, i1, hn::Mul(i2, r1)),
          hn::MulAdd(r1, r1, hn::Mul(i1, i1)), hn::MulAdd(r2, r2, hn::Mul(i2, i2))};
}

BandEnergy CrossPower(const std::complex<float>* z, int z_rows, int z_columns, const Band& band) {
  const Floats d;
  const int L = lanes();
  Vec first = hn::Zero(d), second = hn::Zero(d);
  double first0 = 0, second0 = 0;
  for (int v = -band.rows_v; v <= band.rows_v; ++v) {
    const int row = v < 0 ? v + z_rows : v, mirror = row == 0 ? 0 : z_rows - row;
    const auto* zp = reinterpret_cast<const float*>(z + static_cast<std::ptrdiff_t>(row % z_rows) * z_columns);
    const auto* zm = reinterpret_cast<const float*>(z + static_cast<std::ptrdiff_t>(mirror) * z_columns);
    float *re = band.re + band.offset(v), *im = band.im + band.offset(v);
    {  // u = 0 mirrors onto itself
      const float r1 = zp[0] + zm[0], i1 = zp[1] - zm[1], r2 = zp[1] + zm[1], i2 = zm[0] - zp[0];
      re[0] = r2 * r1 + i2 * i1;
      im[0] = i2 * r1 - r2 * i1;
      first0 += static_cast<double>(r1 * r1 + i1 * i1);
      second0 += static_cast<double>(r2 * r2 + i2 * i2);
    }
    const Vec lane = hn::Iota(d, 0.f);
    for (int u = 1; u <= band.columns_u; u += L) {
      // The last vector starts early enough to end at columns_u; its overlap is stored twice and counted once.
      const int from = u + L - 1 <= band.columns_u ? u : band.columns_u - L + 1 > 0 ? band.columns_u - L + 1 : u;
      Vec p, q, s, t;
      hn::LoadInterleaved2(d, zp + 2 * from, p, q);
      hn::LoadInterleaved2(d, zm + 2 * (z_columns - from - L + 1), s, t);
      const Cross h = cross(p, q, hn::Reverse(d, s), hn::Reverse(d, t));
      hn::StoreU(h.re, d, re + from);
      hn::StoreU(h.im, d, im + from);
      const auto fresh = hn::And(hn::Ge(lane, hn::Set(d, static_cast<float>(u - from))),
                                 hn::Le(lane, hn::Set(d, static_cast<float>(band.columns_u - from))));
      first = hn::Add(first, hn::IfThenElseZero(fresh, h.first));
      second = hn::Add(second, hn::IfThenElseZero(fresh, h.second));
    }
    for (int u = band.columns_u + 1; u < band.pitch; ++u) re[u] = im[u] = 0.f;
  }
  return {first0 + static_cast<double>(total(first)), second0 + static_cast<double>(total(second))};
}

float MeanMagnitude(const Band& band, int u_from) {
  const Floats d;
  const int start = u_from / lanes() * lanes();
  Vec sum = hn::Zero(d);
  for (int v = -band.rows_v; v <= band.rows_v; ++v) {
    const float *re = band.re + band.offset(v), *im = band.im + band.offset(v);
    for (int u = start; u <= band.columns_u; u += lanes()) {
      const Vec a = hn::LoadU(d, re + u), b = hn::LoadU(d, im + u);
      sum = hn::Add(sum, hn::Sqrt(hn::MulAdd(a, a, hn::Mul(b, b))));
    }
  }
  return total(sum) / static_cast<float>((band.columns_u + 1 - start) * band.rows());
}

float Whiten(const Band& h, float noise, const float* wx, const float* wy, const Band& g) {
  const Floats d;
  const Vec floor = hn::Set(d, noise * noise + 1e-30f);
  Vec sum = hn::Zero(d);
  for (int v = 0; v < h.rows(); ++v) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(v) * h.pitch;
    const Vec w = hn::Set(d, wy[v]);
    for (int u = 0; u < h.pitch; u += lanes()) {
      const Vec a = hn::LoadU(d, h.re + row + u), b = hn::LoadU(d, h.im + row + u);
      const Vec square = hn::MulAdd(a, a, hn::Mul(b, b)), magnitude = hn::Sqrt(square);
      const Vec gain = hn::Div(hn::Mul(hn::Mul(w, hn::LoadU(d, wx + u)), magnitude), hn::Add(square, floor));
      hn::StoreU(hn::Mul(a, gain), d, g.re + row + u);
      hn::StoreU(hn::Mul(b, gain), d, g.im + row + u);
      sum = hn::MulAdd(magnitude, gain, sum);
    }
  }
  return total(sum);
}

PeakSums PeakSumsOf(const Band& band, const float* ex_re, const float* ex_im, const float* ey_re, const float* ey_im) {
  const Floats d;
  const Vec step = hn::Set(d, static_cast<float>(lanes()));
  PeakSums sums;
  Vec c = hn::Zero(d), cx = c, cy = c, cxx = c, cxy = c, cyy = c;
  for (int r = 0; r < band.rows(); ++r) {
    const float* re = band.re + static_cast<std::ptrdiff_t>(r) * band.pitch;
    const float* im = band.im + static_cast<std::ptrdiff_t>(r) * band.pitch;
    Vec u = hn::Iota(d, 0.f), r0 = hn::Zero(d), i0 = r0, r1 = r0, i1 = r0, r2 = r0, i2 = r0;
    for (int k = 0; k <= band.columns_u; k += lanes(), u = hn::Add(u, step)) {
      const Vec a = hn::LoadU(d, re + k), b = hn::LoadU(d, im + k);
      const Vec e = hn::LoadU(d, ex_re + k), f = hn::LoadU(d, ex_im + k);
      const Vec x = hn::NegMulAdd(b, f, hn::Mul(a, e)), y = hn::MulAdd(a, f, hn::Mul(b, e));
      const Vec ux = hn::Mul(u, x), uy = hn::Mul(u, y);
      r0 = hn::Add(r0, x);
      i0 = hn::Add(i0, y);
      r1 = hn::Add(r1, ux);
      i1 = hn::Add(i1, uy);
      r2 = hn::MulAdd(u, ux, r2);
      i2 = hn::MulAdd(u, uy, i2);
    }
    const Vec e = hn::Set(d, ey_re[r]), f = hn::Set(d, ey_im[r]);
    const Vec v = hn::Set(d, static_cast<float>(r - band.rows_v));
    const Vec t0 = hn::NegMulAdd(i0, f, hn::Mul(r0, e)), s0 = hn::MulAdd(r0, f, hn::Mul(i0, e));
    const Vec t1 = hn::NegMulAdd(i1, f, hn::Mul(r1, e)), s1 = hn::MulAdd(r1, f, hn::Mul(i1, e));
    const Vec t2 = hn::NegMulAdd(i2, f, hn::Mul(r2, e));
    c = hn::Add(c, t0);
    cx = hn::Sub(cx, s1);
    cy = hn::NegMulAdd(v, s0, cy);
    cxx = hn::Sub(cxx, t2);
    cxy = hn::NegMulAdd(v, t1, cxy);
    cyy = hn::NegMulAdd(hn::Mul(v, v), t0, cyy);
  }
  return {total(c), total(cx), total(cy), total(cxx), total(cxy), total(cyy)};
}

float MaxOf(const float* values, int count) {
  const Floats d;
  Vec best = hn::Set(d, values[0]);
  int i = 0;
  for (; i + lanes() <= count; i += lanes()) best = hn::Max(best, hn::LoadU(d, values + i));
  float most = hn::GetLane(hn::MaxOfLanes(d, best));
  for (; i < count; ++i) most = values[i] > most ? values[i] : most;
  return most;
}

OverlapSums OverlapSumsOf(const float* a, const float* b, int pitch, int rows, int columns) {
  const Floats d;
  Vec sa = hn::Zero(d), sb = sa, saa = sa, sbb = sa, sab = sa;
  const int whole = columns / lanes() * lanes();
  const auto mask = hn::FirstN(d, static_cast<std::size_t>(columns - whole));
  for (int r = 0; r < rows; ++r) {
    const float *ra = a + static_cast<std::ptrdiff_t>(r) * pitch, *rb = b + static_cast<std::ptrdiff_t>(r) * pitch;
    for (int c = 0; c < columns; c += lanes()) {
      Vec x = hn::LoadU(d, ra + c), y = hn::LoadU(d, rb + c);
      if (c == whole) {
        x = hn::IfThenElseZero(mask, x);
        y = hn::IfThenElseZero(mask, y);
      }
      sa = hn::Add(sa, x);
      sb = hn::Add(sb, y);
      saa = hn::MulAdd(x, x, saa);
      sbb = hn::MulAdd(y, y, sbb);
      sab = hn::MulAdd(x, y, sab);
    }
  }
  return {total(sa), total(sb), total(saa), total(sbb), total(sab)};
}

}  // namespace HWY_NAMESPACE
}  // namespace wasp::vision::shift
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision::shift {

HWY_EXPORT(BinImage);
HWY_EXPORT(HalveImage);
HWY_EXPORT(WeightedSum);
HWY_EXPORT(PackPair);
HWY_EXPORT(CrossPower);
HWY_EXPORT(MeanMagnitude);
HWY_EXPORT(Whiten);
HWY_EXPORT(PeakSumsOf);
HWY_EXPORT(MaxOf);
HWY_EXPORT(OverlapSumsOf);

void bin_image(const GrayView& image, int x, int y, int bin, int rows, int columns, float* out, int pitch) noexcept {
  HWY_DYNAMIC_DISPATCH(BinImage)(image, x, y, bin, rows, columns, out, pitch);
}
void halve_image(const float* in, int in_pitch, int rows, int columns, float* out, int pitch) noexcept {
  HWY_DYNAMIC_DISPATCH(HalveImage)(in, in_pitch, rows, columns, out, pitch);
}
float weighted_sum(const float* image, int pitch, int rows, int columns, const float* wx, const float* wy) noexcept {
  return HWY_DYNAMIC_DISPATCH(WeightedSum)(image, pitch, rows, columns, wx, wy);
}
void pack_pair(const float* a, const float* b, int pitch, int rows, int columns, float mean_a, float mean_b,
               const float* wx, const float* wy, std::complex<float>* z, int z_rows, int z_columns) noexcept {
  HWY_DYNAMIC_DISPATCH(PackPair)(a, b, pitch, rows, columns, mean_a, mean_b, wx, wy, z, z_rows, z_columns);
}
BandEnergy cross_power(const std::complex<float>* z, int z_rows, int z_columns, const Band& band) noexcept {
  return HWY_DYNAMIC_DISPATCH(CrossPower)(z, z_rows, z_columns, band);
}
float mean_magnitude(const Band& band, int u_from) noexcept {
  return HWY_DYNAMIC_DISPATCH(MeanMagnitude)(band, u_from);
}
float whiten(const Band& h, float noise, const float* wx, const float* wy, const Band& g) noexcept {
  return HWY_DYNAMIC_DISPATCH(Whiten)(h, noise, wx, wy, g);
}
PeakSums peak_sums(const Band& band, const float* ex_re, const float* ex_im, const float* ey_re,
                   const float* ey_im) noexcept {
  return HWY_DYNAMIC_DISPATCH(PeakSumsOf)(band, ex_re, ex_im, ey_re, ey_im);
}
float max_of(const float* values, int count) noexcept { return HWY_DYNAMIC_DISPATCH(MaxOf)(values, count); }
OverlapSums overlap_sums(const float* a, const float* b, int pitch, int rows, int columns) noexcept {
  return HWY_DYNAMIC_DISPATCH(OverlapSumsOf)(a, b, pitch, rows, columns);
}

}  // namespace wasp::vision::shift
#endif  // HWY_ONCE
