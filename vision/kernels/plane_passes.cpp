// A sample a lane. What does not fill the last vector is padded with points far above any plane, which never count.
#include "vision/kernels/plane_passes.h"

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)  // their vectors fit no array
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/plane_passes.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
// clang-format on

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr float kBelowBands = 1.5f;
constexpr std::size_t kMaxBlock = 16;

/// Calls use(x, y, w) for whole blocks of `block` samples, the last one padded.
template <class Use>
HWY_INLINE void for_blocks(const InverseDepths& points, std::size_t block, const Use& use) {
  const std::size_t n = points.w.size(), whole = n - n % block;
  const float *x = points.x.data(), *y = points.y.data(), *w = points.w.data();
  for (std::size_t i = 0; i < whole; i += block) use(x + i, y + i, w + i);
  if (whole == n) return;
  float last_x[kMaxBlock] = {}, last_y[kMaxBlock] = {}, last_w[kMaxBlock];
  std::fill_n(last_w, kMaxBlock, kAbsent_per_m);
  std::copy(x + whole, x + n, last_x);
  std::copy(y + whole, y + n, last_y);
  std::copy(w + whole, w + n, last_w);
  use(last_x, last_y, last_w);
}

template <class D>
struct PlaneLanes {
  using Floats = hn::Vec<D>;
  D d;
  Floats a, b, c, sensor, slope;

  HWY_INLINE PlaneLanes(const InversePlane& p, const PlaneBand& band)
      : a(hn::Set(d, p.a)),
        b(hn::Set(d, p.b)),
        c(hn::Set(d, p.c)),
        sensor(hn::Set(d, band.sensor)),
        slope(hn::Set(d, band.slope)) {}
  HWY_INLINE Floats residual(Floats x, Floats y, Floats w) const {
    return hn::Sub(w, hn::Add(hn::Add(hn::Mul(a, x), hn::Mul(b, y)), c));
  }
  HWY_INLINE Floats tolerance(Floats w) const { return hn::Add(sensor, hn::Mul(slope, w)); }
};

/// Counts in float lanes: exact up to 2^24 samples a lane.
PlaneSupport support(const InverseDepths& points, const InversePlane& plane, const PlaneBand& band) {
  const hn::CappedTag<float, kMaxBlock> d;
  const PlaneLanes<decltype(d)> lanes(plane, band);
  const auto one = hn::Set(d, 1.f), below_bands = hn::Set(d, -kBelowBands);
  auto inliers = hn::Zero(d), below = hn::Zero(d);
  for_blocks(points, hn::Lanes(d), [&](const float* px, const float* py, const float* pw) HWY_ATTR {
    const auto w = hn::LoadU(d, pw);
    const auto r = lanes.residual(hn::LoadU(d, px), hn::LoadU(d, py), w), tolerance = lanes.tolerance(w);
    inliers = hn::Add(inliers, hn::IfThenElseZero(hn::Lt(hn::Abs(r), tolerance), one));
    below = hn::Add(below, hn::IfThenElseZero(hn::Lt(r, hn::Mul(below_bands, tolerance)), one));
  });
  return {static_cast<int>(hn::GetLane(hn::SumOfLanes(d, inliers))),
          static_cast<int>(hn::GetLane(hn::SumOfLanes(d, below)))};
}

constexpr std::size_t kSumLanes = 8;  ///< partial sums of every moment, on every instruction set
constexpr std::size_t kMoments = 11;

template <bool kDistances>
HWY_INLINE PlaneMoments moments_of(const InverseDepths& points, const InversePlane& plane, const PlaneBand& band) {
  const hn::CappedTag<float, kSumLanes> d;
  constexpr std::size_t kLanes = hn::MaxLanes(hn::CappedTag<float, kSumLanes>()), kParts = kSumLanes / kLanes;
  const PlaneLanes<decltype(d)> lanes(plane, band);
  const auto one = hn::Set(d, 1.f);
  hn::Vec<decltype(d)> sum[kMoments][kParts];
  for (auto& parts : sum)
    for (auto& part : parts) part = hn::Zero(d);
  for_blocks(points, kSumLanes, [&](const float* px, const float* py, const float* pw) HWY_ATTR {
#pragma GCC unroll 8
    for (std::size_t k = 0; k < kParts; ++k) {
      const auto x = hn::LoadU(d, px + k * kLanes), y = hn::LoadU(d, py + k * kLanes),
                 w = hn::LoadU(d, pw + k * kLanes);
      const auto any_r = lanes.residual(x, y, w);
      const auto on = hn::Lt(hn::Abs(any_r), lanes.tolerance(w));
      const auto ox = hn::IfThenElseZero(on, x), oy = hn::IfThenElseZero(on, y), r = hn::IfThenElseZero(on, any_r);
      sum[0][k] = hn::Add(sum[0][k], hn::IfThenElseZero(on, one));
      sum[1][k] = hn::Add(sum[1][k], ox);
      sum[2][k] = hn::Add(sum[2][k], oy);
      sum[3][k] = hn::Add(sum[3][k], r);
      sum[4][k] = hn::Add(sum[4][k], hn::Mul(ox, x));
      sum[5][k] = hn::Add(sum[5][k], hn::Mul(ox, y));
      sum[6][k] = hn::Add(sum[6][k], hn::Mul(oy, y));
      sum[7][k] = hn::Add(sum[7][k], hn::Mul(r, x));
      sum[8][k] = hn::Add(sum[8][k], hn::Mul(r, y));
      sum[9][k] = hn::Add(sum[9][k], hn::Mul(r, r));
      if constexpr (kDistances) {
        const auto distance = hn::Div(r, w);
        sum[10][k] = hn::Add(sum[10][k], hn::Mul(distance, distance));
      }
    }
  });
  double total[kMoments];
  for (std::size_t m = 0; m < kMoments; ++m) {
    float s[kSumLanes];
    for (std::size_t k = 0; k < kParts; ++k) hn::StoreU(sum[m][k], d, s + k * kLanes);
    const auto pair = [&s](std::size_t i) { return static_cast<double>(s[i]) + static_cast<double>(s[i + 4]); };
    total[m] = (pair(0) + pair(1)) + (pair(2) + pair(3));
  }
  return {total[0], total[1], total[2], total[3], total[4], total[5],
          total[6], total[7], total[8], total[9], total[10]};
}

PlaneMoments moments(const InverseDepths& points, const InversePlane& plane, const PlaneBand& band) {
  return moments_of<false>(points, plane, band);
}
PlaneMoments moments_and_distances(const InverseDepths& points, const InversePlane& plane, const PlaneBand& band) {
  return moments_of<true>(points, plane, band);
}

void invert(const std::array<std::uint16_t, kSampleCount>& mm, int min_mm, int max_mm,
            std::array<float, kSampleCount>& w) {
  const hn::CappedTag<float, kMaxBlock> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::Rebind<std::uint16_t, decltype(d)> d16;
  static_assert(kSampleCount % kMaxBlock == 0);
  const auto thousand = hn::Set(d, 1000.f), absent = hn::Set(d, kAbsent_per_m);
  const auto least = hn::Set(di, min_mm), most = hn::Set(di, max_mm);
  for (std::size_t i = 0; i < kSampleCount; i += hn::Lanes(d)) {
    const auto depth = hn::PromoteTo(di, hn::LoadU(d16, &mm[i]));
    const auto outside = hn::RebindMask(d, hn::Or(hn::Lt(depth, least), hn::Gt(depth, most)));
    hn::StoreU(hn::IfThenElse(outside, absent, hn::Div(thousand, hn::ConvertTo(d, depth))), d, &w[i]);
  }
}

}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision {
namespace {
HWY_EXPORT(support);
HWY_EXPORT(moments);
HWY_EXPORT(invert);
HWY_EXPORT(moments_and_distances);
}  // namespace

PlaneSupport pass_support(const InverseDepths& points, const InversePlane& plane, const PlaneBand& band) noexcept {
  return HWY_DYNAMIC_DISPATCH(support)(points, plane, band);
}
PlaneMoments pass_moments(const InverseDepths& points, const InversePlane& plane, const PlaneBand& band,
                          bool distances) noexcept {
  return distances ? HWY_DYNAMIC_DISPATCH(moments_and_distances)(points, plane, band)
                   : HWY_DYNAMIC_DISPATCH(moments)(points, plane, band);
}
void pass_invert(const std::array<std::uint16_t, kSampleCount>& mm, int min_mm, int max_mm,
                 std::array<float, kSampleCount>& w) noexcept {
  HWY_DYNAMIC_DISPATCH(invert)(mm, min_mm, max_mm, w);
}

}  // namespace wasp::vision
#endif  // HWY_ONCE
