// A point a lane; the means are broadcast and the sums stay in registers, one set a cluster.
#include "vision/kernels/cluster_pass.h"

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)  // their vectors fit no array
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/cluster_pass.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

const hn::ScalableTag<float> kFloats;
const hn::RebindToSigned<decltype(kFloats)> kInts;
using Floats = hn::Vec<decltype(kFloats)>;

HWY_INLINE float total(Floats x) { return hn::GetLane(hn::SumOfLanes(kFloats, x)); }

template <int kCount>
HWY_INLINE void pass_of(const ClusterPoints& points, const ClusterMeans& means, ClusterPass& out) {
  const Floats zero = hn::Zero(kFloats), one = hn::Set(kFloats, 1.f);
  Floats mean_x[kCount], mean_y[kCount], size[kCount], sum_x[kCount], sum_y[kCount];
  for (std::size_t c = 0; c < kCount; ++c) {
    mean_x[c] = hn::Set(kFloats, means.x[c]);
    mean_y[c] = hn::Set(kFloats, means.y[c]);
    size[c] = sum_x[c] = sum_y[c] = zero;
  }
  Floats compactness = zero;
  for (std::size_t i = 0; i < points.count; i += hn::Lanes(kFloats)) {
    const Floats x = hn::Load(kFloats, &points.x[i]), y = hn::Load(kFloats, &points.y[i]);
    Floats best = hn::Set(kFloats, 3e38f);
    auto label = hn::Zero(kInts);
    for (std::size_t c = 0; c < kCount; ++c) {
      const Floats dx = hn::Sub(x, mean_x[c]), dy = hn::Sub(y, mean_y[c]);
      const Floats distance2 = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
      const auto nearer = hn::Lt(distance2, best);
      best = hn::Min(best, distance2);
      label = hn::IfThenElse(hn::RebindMask(kInts, nearer), hn::Set(kInts, static_cast<std::int32_t>(c)), label);
    }
    hn::Store(best, kFloats, &out.distance2[i]);
    hn::Store(label, kInts, &out.label[i]);
    const auto real = hn::FirstN(kFloats, points.count - i);
    compactness = hn::Add(compactness, hn::IfThenElseZero(real, best));
    for (std::size_t c = 0; c < kCount; ++c) {
      const auto here = hn::Eq(label, hn::Set(kInts, static_cast<std::int32_t>(c)));
      const auto mine = hn::And(hn::RebindMask(kFloats, here), real);
      size[c] = hn::Add(size[c], hn::IfThenElseZero(mine, one));
      sum_x[c] = hn::Add(sum_x[c], hn::IfThenElseZero(mine, x));
      sum_y[c] = hn::Add(sum_y[c], hn::IfThenElseZero(mine, y));
    }
  }
  out.compactness = total(compactness);
  for (std::size_t c = 0; c < kCount; ++c) {
    out.size[c] = total(size[c]);
    out.sum_x[c] = total(sum_x[c]);
    out.sum_y[c] = total(sum_y[c]);
  }
}

void pass(const ClusterPoints& points, const ClusterMeans& means, ClusterPass& out) {
  static_assert(kMaxClusters == 4);
  switch (means.count) {
    case 1:
      return pass_of<1>(points, means, out);
    case 2:
      return pass_of<2>(points, means, out);
    case 3:
      return pass_of<3>(points, means, out);
    default:
      return pass_of<4>(points, means, out);
  }
}

}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision {
namespace {
HWY_EXPORT(pass);
}  // namespace

void cluster_pass_simd(const ClusterPoints& points, const ClusterMeans& means, ClusterPass& out) noexcept {
  HWY_DYNAMIC_DISPATCH(pass)(points, means, out);
}

void cluster_pass_reference(const ClusterPoints& points, const ClusterMeans& means, ClusterPass& out) noexcept {
  out.compactness = 0;
  out.size = out.sum_x = out.sum_y = {};
  for (std::size_t i = 0; i < points.count; ++i) {
    out.distance2[i] = 3e38f;
    for (std::size_t c = 0; c < static_cast<std::size_t>(means.count); ++c) {
      const float dx = points.x[i] - means.x[c], dy = points.y[i] - means.y[c], distance2 = dx * dx + dy * dy;
      if (distance2 >= out.distance2[i]) continue;
      out.distance2[i] = distance2;
      out.label[i] = static_cast<std::int32_t>(c);
    }
    const auto mine = static_cast<std::size_t>(out.label[i]);
    out.compactness += out.distance2[i];
    out.size[mine] += 1.f;
    out.sum_x[mine] += points.x[i];
    out.sum_y[mine] += points.y[i];
  }
}

}  // namespace wasp::vision
#endif  // HWY_ONCE
