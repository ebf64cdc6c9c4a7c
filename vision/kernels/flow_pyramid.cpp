#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/flow_pyramid.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/cache_control.h>
#include <hwy/highway.h>
// clang-format on
#include <algorithm>

#include "vision/kernels/flow_pyramid.h"

HWY_BEFORE_NAMESPACE();
namespace wasp::vision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Byte = std::uint8_t;

/// (a + 3 b + 3 c + d) / 8 by three averages, each rounded up.
int blend(int a, int b, int c, int d) {
  const auto average = [](int x, int y) { return (x + y + 1) / 2; };
  const int inner = average(b, c);
  return average(average(average(a, d), inner), inner);
}

#if HWY_TARGET != HWY_SCALAR

const hn::ScalableTag<Byte> kBytes;

HWY_INLINE hn::Vec<decltype(kBytes)> blend_at(const Byte* a, const Byte* b, const Byte* c, const Byte* d) {
  const auto inner = hn::AverageRound(hn::LoadU(kBytes, b), hn::LoadU(kBytes, c));
  const auto outer = hn::AverageRound(hn::LoadU(kBytes, a), hn::LoadU(kBytes, d));
  return hn::AverageRound(hn::AverageRound(outer, inner), inner);
}

/// Columns first, even and odd pixels apart. The last vectors overlap those before.
HWY_INLINE void blend_rows(const Byte* a, const Byte* b, const Byte* c, const Byte* d, int width_px, Byte* even,
                           Byte* odd) {
  const int lanes = static_cast<int>(hn::Lanes(kBytes)), last = (width_px - 2 * lanes) / 2 * 2;
  int done = 0;
  while (last >= 0 && done + 1 < width_px) {
    const int u = std::min(done, last), v = u + lanes;
    const auto left = blend_at(a + u, b + u, c + u, d + u), right = blend_at(a + v, b + v, c + v, d + v);
    hn::StoreU(hn::ConcatEven(kBytes, right, left), kBytes, even + u / 2);
    hn::StoreU(hn::ConcatOdd(kBytes, right, left), kBytes, odd + u / 2);
    done = u + 2 * lanes;
  }
  for (int u = done; u < width_px; ++u)
    ((u & 1) == 0 ? even : odd)[u / 2] = static_cast<Byte>(blend(a[u], b[u], c[u], d[u]));
}

/// Then rows. Goes on to the end of a vector.
HWY_INLINE void halve_row(const Byte* even, const Byte* odd, int out_width_px, Byte* out) {
  const int lanes = static_cast<int>(hn::Lanes(kBytes));
  for (int i = 0; i < out_width_px; i += lanes)
    hn::StoreU(blend_at(odd + i - 1, even + i, odd + i, even + i + 1), kBytes, out + i);
}

#else

void blend_rows(const Byte* a, const Byte* b, const Byte* c, const Byte* d, int width_px, Byte* even, Byte* odd) {
  for (int u = 0; u < width_px; ++u)
    ((u & 1) == 0 ? even : odd)[u / 2] = static_cast<Byte>(blend(a[u], b[u], c[u], d[u]));
}

void halve_row(const Byte* even, const Byte* odd, int out_width_px, Byte* out) {
  for (int i = 0; i < out_width_px; ++i) out[i] = static_cast<Byte>(blend(odd[i - 1], even[i], odd[i], even[i + 1]));
}

#endif

/// Asks for a row that comes to be blended some rows later: a camera's frame lies in another core's cache or in memory.
HWY_INLINE void fetch_row(const GrayView& in, int v) {
  if (v >= in.height_px) return;
  for (int u = 0; u < in.width_px; u += FlowPyramid::kMostLanes) hwy::Prefetch(in.row(v) + u);
}

/// Rows are halved some rows behind their blending: bytes are read long after they were written, when they have left
/// the store queue, which cannot hand them over in other pieces.
void halve(const GrayView& in, int readable_px, Byte* out, int out_stride_px, Byte* scratch) {
  constexpr int kAhead = 16, kLag = FlowPyramid::kScratchRows - 1, kMargin = FlowPyramid::kMostLanes;
  const int last = in.height_px - 1, rows = in.height_px / 2, half = in.width_px / 2;
  const int length = readable_px / 2 + 3 * kMargin;
  const auto even_of = [&](int v) { return scratch + kMargin + v % FlowPyramid::kScratchRows * 2 * length; };
  for (int v = 0; v < rows + kLag; ++v) {
    if (v < rows) {
      const Byte *a = in.row(std::max(2 * v - 1, 0)), *b = in.row(2 * v), *c = in.row(2 * v + 1);
      const Byte* d = in.row(std::min(2 * v + 2, last));
      Byte *even = even_of(v), *odd = even + length;
      fetch_row(in, 2 * v + kAhead);
      fetch_row(in, 2 * v + kAhead + 1);
      blend_rows(a, b, c, d, readable_px, even, odd);
      const int u = std::min(2 * half, in.width_px - 1);  // borders repeat
      odd[-1] = static_cast<Byte>(blend(a[0], b[0], c[0], d[0]));
      even[half] = static_cast<Byte>(blend(a[u], b[u], c[u], d[u]));
    }
    if (v >= kLag) {
      const Byte* even = even_of(v - kLag);
      halve_row(even, even + length, half, out + static_cast<std::ptrdiff_t>(v - kLag) * out_stride_px);
    }
  }
}

}  // namespace wasp::vision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision {

HWY_EXPORT(halve);

void halve_image(const GrayView& in, int readable_px, std::uint8_t* out, int out_stride_px,
                 std::uint8_t* row) noexcept {
  HWY_DYNAMIC_DISPATCH(halve)(in, readable_px, out, out_stride_px, row);
}

FlowPyramid::FlowPyramid(int width_px, int height_px, int levels)
    : width_px_(std::max(width_px, 0)),
      height_px_(std::max(height_px, 0)),
      row_(static_cast<std::size_t>(scratch_bytes(width_px_ + 2 * kMostLanes))) {
  int w = width_px_, h = height_px_;
  for (int i = 0; i < std::min(levels, kMaxLevels) && std::min(w, h) >= kMinSidePx; ++i, w /= 2, h /= 2) {
    const int stride = (w + 2 * kMostLanes - 1) / (2 * kMostLanes) * 2 * kMostLanes;
    auto& pixels = pixels_[static_cast<std::size_t>(i)];
    if (i > 0) pixels.resize(static_cast<std::size_t>(stride) * static_cast<std::size_t>(h));
    views_[static_cast<std::size_t>(i)] = {pixels.data(), w, h, stride};
    levels_ = i + 1;
  }
}

bool FlowPyramid::fits(const GrayView& image) const noexcept {
  return image.valid() && image.width_px == width_px_ && image.height_px == height_px_ && levels_ > 0;
}

bool FlowPyramid::renew(const GrayView& image) noexcept {
  if (!fits(image)) return false;
  views_[0] = image;
  return true;
}

bool FlowPyramid::build(const GrayView& image) noexcept {
  if (!renew(image)) return false;
  for (std::size_t i = 1; i < static_cast<std::size_t>(levels_); ++i)
    halve_image(views_[i - 1], i == 1 ? width_px_ : views_[i - 1].stride_px, pixels_[i].data(), views_[i].stride_px,
                row_.data());
  return true;
}

}  // namespace wasp::vision
#endif
