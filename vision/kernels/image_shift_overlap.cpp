// Highway compiles this file once for each instruction set. Rows are padded, so loops run whole vectors and only
// reductions mask their tail.
#include "vision/kernels/image_shift_overlap.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/image_shift_overlap.cpp"
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

HWY_EXPORT(MaxOf);
HWY_EXPORT(OverlapSumsOf);

float max_of(const float* values, int count) noexcept { return HWY_DYNAMIC_DISPATCH(MaxOf)(values, count); }
OverlapSums overlap_sums(const float* a, const float* b, int pitch, int rows, int columns) noexcept {
  return HWY_DYNAMIC_DISPATCH(OverlapSumsOf)(a, b, pitch, rows, columns);
}

}  // namespace wasp::vision::shift
#endif  // HWY_ONCE
