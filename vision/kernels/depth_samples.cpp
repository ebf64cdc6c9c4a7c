// Table once; per frame fetch all pixels first, so that their cache misses overlap. Nothing branches on the data.
#include "vision/kernels/depth_samples.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "vision/kernels/camera_model.h"
#include "vision/kernels/plane_passes.h"

namespace wasp::vision {
namespace {

static_assert(std::is_trivially_copyable_v<Intrinsics>);

/// A well mixed 32-bit hash (Wellons' lowbias32).
constexpr std::uint32_t mix(std::uint32_t h) noexcept {
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h = (h ^ (h >> 15)) * 0x846ca68bu;
  return h ^ (h >> 16);
}

/// Pixel in 0 ... size-1, inside cell `index` of `cells`, at the cell's fraction `jitter` (0 ... 65535).
std::uint16_t place(int index, int cells, int size, std::uint32_t jitter) noexcept {
  const int begin = index * size / cells;
  const int extent = std::max(1, (index + 1) * size / cells - begin);
  return static_cast<std::uint16_t>(
      std::min(begin + static_cast<int>((jitter * static_cast<std::uint32_t>(extent)) >> 16), size - 1));
}

bool same(const Intrinsics& a, const Intrinsics& b) noexcept { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

bool prepare(SampleTable& table, const Intrinsics& k) noexcept {
  if (same(table.intrinsics, k)) return true;
  if (!usable(k) || std::min(k.width_px, k.height_px) < kMinImageSide || std::max(k.width_px, k.height_px) > 32768)
    return false;
  for (int cell = 0; cell < kSampleCount; ++cell) {
    const std::uint32_t hash = mix(static_cast<std::uint32_t>(cell) + 1u);
    const auto i = static_cast<std::size_t>(cell);
    table.u_px[i] = place(cell % kSampleColumns, kSampleColumns, k.width_px, hash & 0xffffu);
    table.v_px[i] = place(cell / kSampleColumns, kSampleRows, k.height_px, hash >> 16);
    Ray ray;
    const bool seen = unproject(k, {static_cast<float>(table.u_px[i]), static_cast<float>(table.v_px[i])}, ray);
    table.seen[i] = seen ? 0xffff : 0;
    table.x[i] = ray.x;
    table.y[i] = ray.y;
  }
  table.intrinsics = k;
  return true;
}

void gather(const SampleTable& table, const DepthView& depth, const DepthRange& range, DepthSamples& out) noexcept {
  const auto min_mm = static_cast<int>(std::clamp(range.min_m * 1000.f, 1.f, 65534.f));
  const auto max_mm = static_cast<int>(std::clamp(range.max_m * 1000.f, static_cast<float>(min_mm), 65534.f));
  alignas(64) std::array<std::uint16_t, kSampleCount> mm;
  for (std::size_t i = 0; i < kSampleCount; ++i) mm[i] = depth.row(table.v_px[i])[table.u_px[i]] & table.seen[i];
  pass_invert(mm, min_mm, max_mm, out.w);
  const auto span = static_cast<unsigned>(max_mm - min_mm);  // as unsigned, one comparison tells
  std::size_t n = 0;
  for (std::size_t i = 0; i < kSampleCount; ++i) {
    out.valid[n] = static_cast<std::int16_t>(i);
    n += static_cast<unsigned>(mm[i] - min_mm) <= span ? 1 : 0;
  }
  out.count = static_cast<int>(n);
}

}  // namespace wasp::vision
