// Highway compiles this file once for each instruction set. Rows are padded, so loops run whole vectors and only
// reductions mask their tail.
#include "vision/kernels/image_shift_spectrum.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/image_shift_spectrum.cpp"
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

}  // namespace HWY_NAMESPACE
}  // namespace wasp::vision::shift
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision::shift {

HWY_EXPORT(WeightedSum);
HWY_EXPORT(PackPair);
HWY_EXPORT(CrossPower);
HWY_EXPORT(MeanMagnitude);
HWY_EXPORT(Whiten);
HWY_EXPORT(PeakSumsOf);

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

}  // namespace wasp::vision::shift
#endif  // HWY_ONCE
