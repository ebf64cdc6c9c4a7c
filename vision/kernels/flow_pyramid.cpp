#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/flow_pyramid.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
// clang-format on
#include <algorithm>

#include "vision/kernels/flow_pyramid.h"

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Columns first: a + 3 b + 3 c + d, at most 2,040.
void sum_rows(const std::uint8_t* HWY_RESTRICT a, const std::uint8_t* HWY_RESTRICT b,
              const std::uint8_t* HWY_RESTRICT c, const std::uint8_t* HWY_RESTRICT d, int width_px,
              std::uint16_t* HWY_RESTRICT sum) {
  const hn::ScalableTag<std::uint16_t> tag;
  const hn::Rebind<std::uint8_t, decltype(tag)> bytes;
  const int lanes = static_cast<int>(hn::Lanes(tag));
  int u = 0;
  for (; u + lanes <= width_px; u += lanes) {
    const auto inner =
        hn::Add(hn::PromoteTo(tag, hn::LoadU(bytes, b + u)), hn::PromoteTo(tag, hn::LoadU(bytes, c + u)));
    const auto outer =
        hn::Add(hn::PromoteTo(tag, hn::LoadU(bytes, a + u)), hn::PromoteTo(tag, hn::LoadU(bytes, d + u)));
    hn::StoreU(hn::Add(outer, hn::Add(inner, hn::Add(inner, inner))), tag, sum + u);
  }
  for (; u < width_px; ++u) sum[u] = static_cast<std::uint16_t>(a[u] + 3 * (b[u] + c[u]) + d[u]);
}

/// Then rows: out[i] from sum[2 i - 1 ... 2 i + 2], rounded. sum[-1] and sum[width] must be readable.
void halve_row(const std::uint16_t* HWY_RESTRICT sum, int out_width_px, std::uint8_t* HWY_RESTRICT out) {
  const hn::ScalableTag<std::uint16_t> tag;
  const hn::Rebind<std::uint8_t, decltype(tag)> bytes;
  const int lanes = static_cast<int>(hn::Lanes(tag));
  const auto half = hn::Set(tag, std::uint16_t{32});
  int i = 0;
  for (; i + lanes <= out_width_px; i += lanes) {
    hn::Vec<decltype(tag)> before, even, odd, after, unused;
    hn::LoadInterleaved2(tag, sum + 2 * i, even, odd);
    hn::LoadInterleaved2(tag, sum + 2 * i - 1, before, unused);
    hn::LoadInterleaved2(tag, sum + 2 * i + 1, unused, after);
    const auto inner = hn::Add(even, odd);
    const auto total = hn::Add(hn::Add(hn::Add(before, after), half), hn::Add(inner, hn::Add(inner, inner)));
    hn::StoreU(hn::DemoteTo(bytes, hn::BitCast(hn::RebindToSigned<decltype(tag)>(), hn::ShiftRight<6>(total))), bytes,
               out + i);
  }
  for (; i < out_width_px; ++i)
    out[i] = static_cast<std::uint8_t>((sum[2 * i - 1] + 3 * (sum[2 * i] + sum[2 * i + 1]) + sum[2 * i + 2] + 32) >> 6);
}

void halve(const GrayView& in, std::uint8_t* out, int out_stride_px, std::uint16_t* row) {
  const int last = in.height_px - 1, width = in.width_px;
  std::uint16_t* sum = row + 16;
  for (int v = 0; v < in.height_px / 2; ++v) {
    sum_rows(in.row(std::max(2 * v - 1, 0)), in.row(2 * v), in.row(2 * v + 1), in.row(std::min(2 * v + 2, last)), width,
             sum);
    sum[-1] = sum[0];
    sum[width] = sum[width - 1];
    halve_row(sum, width / 2, out + static_cast<std::ptrdiff_t>(v) * out_stride_px);
  }
}

}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision {

HWY_EXPORT(halve);

void halve_image(const GrayView& in, std::uint8_t* out, int out_stride_px, std::uint16_t* row) noexcept {
  HWY_DYNAMIC_DISPATCH(halve)(in, out, out_stride_px, row);
}

FlowPyramid::FlowPyramid(int width_px, int height_px, int levels)
    : width_px_(std::max(width_px, 0)),
      height_px_(std::max(height_px, 0)),
      row_(static_cast<std::size_t>(width_px_) + 64) {
  int w = width_px_, h = height_px_;
  for (int i = 0; i < std::min(levels, kMaxLevels) && std::min(w, h) >= kMinSidePx; ++i, w /= 2, h /= 2) {
    if (i > 0) pixels_[static_cast<std::size_t>(i)].resize(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
    views_[static_cast<std::size_t>(i)] = {pixels_[static_cast<std::size_t>(i)].data(), w, h, w};
    levels_ = i + 1;
  }
}

bool FlowPyramid::build(const GrayView& image) noexcept {
  if (!image.valid() || image.width_px != width_px_ || image.height_px != height_px_ || levels_ == 0) return false;
  views_[0] = image;
  for (std::size_t i = 1; i < static_cast<std::size_t>(levels_); ++i)
    halve_image(views_[i - 1], pixels_[i].data(), views_[i].stride_px, row_.data());
  return true;
}

}  // namespace wasp::vision
#endif
