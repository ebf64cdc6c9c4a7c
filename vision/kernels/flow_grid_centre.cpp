// flow_grid: a patch at the cell's centre is compared at a first guess. Vectors are of fixed size, so an SVE machine is
// served by its NEON half.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/flow_grid_centre.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
// clang-format on
#include <cmath>

#include "vision/kernels/flow_grid_centre.h"

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

int sum_of(const CentrePatch& patch) { return centre_sum_plain(patch); }

#else

#if HWY_MAX_BYTES >= 64
constexpr std::size_t kRows = 2, kWidth = kCentreWidthPx;  // of a vector: rows k and k + kSteps
#else
constexpr std::size_t kRows = 1, kWidth = HWY_MAX_BYTES >= 32 ? 16 : 8;
#endif
constexpr std::size_t kSteps = kCentreHeightPx / kRows;
const hn::FixedTag<std::int16_t, kRows * kWidth> kShorts;
const hn::FixedTag<std::int32_t, kRows * kWidth / 2> kInts;
using Shorts = hn::Vec<decltype(kShorts)>;

HWY_INLINE Shorts load_rows(const std::uint8_t* p, std::ptrdiff_t stride) {
  const hn::FixedTag<std::uint8_t, kWidth> row;
#if HWY_MAX_BYTES >= 64
  const hn::FixedTag<std::uint8_t, kRows * kWidth> rows;
  constexpr auto kApart = static_cast<std::ptrdiff_t>(kSteps);
  return hn::PromoteTo(kShorts, hn::Combine(rows, hn::LoadU(row, p + kApart * stride), hn::LoadU(row, p)));
#else
  static_cast<void>(stride);
  return hn::PromoteTo(kShorts, hn::LoadU(row, p));
#endif
}

int sum_of(const CentrePatch& patch) {
  const auto left = hn::Set(kShorts, static_cast<std::int16_t>(128 - patch.u_part));
  const auto right = hn::Set(kShorts, static_cast<std::int16_t>(patch.u_part));
  const auto down = hn::Set(kShorts, static_cast<std::int16_t>(patch.v_part));
  const auto most = hn::Set(kShorts, std::int16_t{128 * kCentreMostGray});
  const auto across = [&](const std::uint8_t* p) HWY_ATTR {
    return hn::Add(hn::Mul(load_rows(p, patch.moved_stride), left),
                   hn::Mul(load_rows(p + 1, patch.moved_stride), right));
  };
  auto total = hn::Zero(kInts), rest = total;
  for (std::size_t u = 0; u < kCentreWidthPx; u += kWidth) {
    const std::uint8_t *p = patch.moved + u, *q = patch.still + u;
    auto sum = hn::Zero(kShorts);  // at most 12 x 2,560
    auto row = across(p);
    for (std::size_t v = 0; v < kSteps; ++v) {
      p += patch.moved_stride;
      const auto next = across(p);
      const auto moved = hn::Add(row, hn::MulFixedPoint15(hn::Sub(next, row), down));
      const auto still = hn::ShiftLeft<7>(load_rows(q, patch.still_stride));
      sum = hn::Add(sum, hn::Min(hn::Abs(hn::Sub(moved, still)), most));
      q += patch.still_stride;
      row = next;
    }
    total = hn::ReorderWidenMulAccumulate(kInts, sum, hn::Set(kShorts, std::int16_t{1}), total, rest);
  }
  return static_cast<int>(hn::GetLane(hn::SumOfLanes(kInts, hn::Add(total, rest))));
}

#endif

}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision {

HWY_EXPORT(sum_of);

int centre_sum(const CentrePatch& patch) noexcept { return HWY_DYNAMIC_DISPATCH(sum_of)(patch); }

float centre_cost(const GrayView& first, const GrayView& second, int u_px, int v_px, float shift_u,
                  float shift_v) noexcept {
  const float u = static_cast<float>(u_px) + shift_u, v = static_cast<float>(v_px) + shift_v;
  const bool inside = u >= 0.f && v >= 0.f && u < static_cast<float>(second.width_px - kCentreWidthPx) &&
                      v < static_cast<float>(second.height_px - kCentreHeightPx);
  if (!inside) return static_cast<float>(kCentreMostGray);
  const int whole_u = static_cast<int>(u), whole_v = static_cast<int>(v);
  const float part_u = u - static_cast<float>(whole_u), part_v = v - static_cast<float>(whole_v);
  const CentrePatch patch{
      first.row(v_px) + u_px, second.row(whole_v) + whole_u,           first.stride_px,
      second.stride_px,       static_cast<int>(part_u * 128.f + 0.5f), static_cast<int>(part_v * 32767.f)};
  return static_cast<float>(centre_sum(patch)) / static_cast<float>(128 * kCentreWidthPx * kCentreHeightPx);
}

}  // namespace wasp::vision
#endif
