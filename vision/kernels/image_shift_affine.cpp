// Highway compiles this file once for each instruction set. The second image's row is read first, into a line buffer:
// by one blend of four neighbours where the motion is a plain shift, by gathering where it is not.
#include "vision/kernels/image_shift_affine.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vision/kernels/image_shift_affine.cpp"
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
HWY_INLINE Vec blend(Vec from, Vec to, Vec share) { return hn::MulAdd(hn::Sub(to, from), share, from); }

/// Where column `c`, row `r` of the first image lies in units of the affine motion.
struct Frame {
  float middle_x, middle_y, unit;
};
HWY_INLINE Frame frame_of(const ImagePair& images) {
  const int longest = images.columns > images.rows ? images.columns : images.rows;
  return {0.5f * static_cast<float>(images.columns - 1), 0.5f * static_cast<float>(images.rows - 1),
          2.f / static_cast<float>(longest)};
}

/// The second image at (column + i + dx, row + dy): the caller's region keeps all four neighbours inside.
void shifted_row(const ImagePair& images, int column, int row, int count, float dx, float dy, float* out) {
  const Floats d;
  const float fx = std::floor(dx), fy = std::floor(dy);
  const float* top = images.second + static_cast<std::ptrdiff_t>(row + static_cast<int>(fy)) * images.pitch + column +
                     static_cast<int>(fx);
  const float* low = top + images.pitch;
  const Vec sx = hn::Set(d, dx - fx), sy = hn::Set(d, dy - fy);
  for (int i = 0; i < count; i += lanes()) {
    const Vec upper = blend(hn::LoadU(d, top + i), hn::LoadU(d, top + i + 1), sx);
    const Vec lower = blend(hn::LoadU(d, low + i), hn::LoadU(d, low + i + 1), sx);
    hn::StoreU(blend(upper, lower, sy), d, out + i);
  }
}

void warped_row(const ImagePair& images, int column, int row, int count, const Affine& m, float* out) {
  const Floats d;
  const hn::RebindToSigned<Floats> di;
  const Frame frame = frame_of(images);
  const float y = (static_cast<float>(row) - frame.middle_y) * frame.unit;
  const Vec zero = hn::Zero(d), x_most = hn::Set(d, static_cast<float>(images.columns) - 1.001f),
            y_most = hn::Set(d, static_cast<float>(images.rows) - 1.001f),
            pitch = hn::Set(d, static_cast<float>(images.pitch));
  Vec c = hn::Iota(d, static_cast<float>(column));
  for (int i = 0; i < count; i += lanes(), c = hn::Add(c, hn::Set(d, static_cast<float>(lanes())))) {
    const Vec x = hn::Mul(hn::Sub(c, hn::Set(d, frame.middle_x)), hn::Set(d, frame.unit));
    const Vec at_x = hn::MulAdd(hn::Set(d, m.xx), x, hn::Add(c, hn::Set(d, m.dx + m.xy * y)));
    const Vec at_y = hn::MulAdd(hn::Set(d, m.yx), x, hn::Set(d, static_cast<float>(row) + m.dy + m.yy * y));
    const Vec u = hn::Min(hn::Max(at_x, zero), x_most), v = hn::Min(hn::Max(at_y, zero), y_most);
    const Vec u0 = hn::Floor(u), v0 = hn::Floor(v), su = hn::Sub(u, u0), sv = hn::Sub(v, v0);
    const auto index = hn::ConvertTo(di, hn::MulAdd(v0, pitch, u0));
    const float *top = images.second, *low = images.second + images.pitch;
    const Vec upper = blend(hn::GatherIndex(d, top, index), hn::GatherIndex(d, top + 1, index), su);
    const Vec lower = blend(hn::GatherIndex(d, low, index), hn::GatherIndex(d, low + 1, index), su);
    hn::StoreU(blend(upper, lower, sv), d, out + i);
  }
}

/// One row's sums by powers of x.
struct RowSums {
  Vec gxx[3], gxy[3], gyy[3], gxe[2], gye[2], ee;
};

HWY_INLINE RowSums row_sums(const ImagePair& images, const float* a, const float* b, const Region& region, float weight,
                            Vec x, Vec x_step) {
  const Floats d;
  const Vec zero = hn::Zero(d), half = hn::Set(d, 0.5f), gain = hn::Set(d, images.gain),
            offset = hn::Set(d, images.offset), row_weight = hn::Set(d, weight);
  RowSums s{{zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}, {zero, zero}, {zero, zero}, zero};
  for (int i = 0; i < region.columns; i += lanes(), x = hn::Add(x, x_step)) {
    const Vec w = hn::Mul(row_weight, hn::LoadU(d, region.weight_x + i));
    const Vec e = hn::Sub(hn::MulAdd(gain, hn::LoadU(d, b + i), offset), hn::LoadU(d, a + i));
    const Vec gx = hn::Mul(half, hn::Sub(hn::LoadU(d, a + i + 1), hn::LoadU(d, a + i - 1)));
    const Vec gy = hn::Mul(half, hn::Sub(hn::LoadU(d, a + i + images.pitch), hn::LoadU(d, a + i - images.pitch)));
    const Vec wx = hn::Mul(w, gx), wy = hn::Mul(w, gy), xx = hn::Mul(x, x);
    const Vec gxx = hn::Mul(wx, gx), gxy = hn::Mul(wx, gy), gyy = hn::Mul(wy, gy);
    const Vec gxe = hn::Mul(wx, e), gye = hn::Mul(wy, e);
    s.gxx[0] = hn::Add(s.gxx[0], gxx), s.gxx[1] = hn::MulAdd(gxx, x, s.gxx[1]),
    s.gxx[2] = hn::MulAdd(gxx, xx, s.gxx[2]);
    s.gxy[0] = hn::Add(s.gxy[0], gxy), s.gxy[1] = hn::MulAdd(gxy, x, s.gxy[1]),
    s.gxy[2] = hn::MulAdd(gxy, xx, s.gxy[2]);
    s.gyy[0] = hn::Add(s.gyy[0], gyy), s.gyy[1] = hn::MulAdd(gyy, x, s.gyy[1]),
    s.gyy[2] = hn::MulAdd(gyy, xx, s.gyy[2]);
    s.gxe[0] = hn::Add(s.gxe[0], gxe), s.gxe[1] = hn::MulAdd(gxe, x, s.gxe[1]);
    s.gye[0] = hn::Add(s.gye[0], gye), s.gye[1] = hn::MulAdd(gye, x, s.gye[1]);
    s.ee = hn::MulAdd(hn::Mul(w, e), e, s.ee);
  }
  return s;
}

/// Sums by powers of x and y, a lane each until the end.
struct LaneSums {
  Vec gxx[6], gxy[6], gyy[6], gxe[3], gye[3], ee;
};

/// Adds a row's sums, by powers of x.
HWY_INLINE void add_square(const Vec (&row)[3], Vec y, Vec yy, Vec (&sums)[6]) {
  sums[0] = hn::Add(sums[0], row[0]);
  sums[1] = hn::Add(sums[1], row[1]);
  sums[2] = hn::MulAdd(y, row[0], sums[2]);
  sums[3] = hn::Add(sums[3], row[2]);
  sums[4] = hn::MulAdd(y, row[1], sums[4]);
  sums[5] = hn::MulAdd(yy, row[0], sums[5]);
}
HWY_INLINE void add_line(const Vec (&row)[2], Vec y, Vec (&sums)[3]) {
  sums[0] = hn::Add(sums[0], row[0]);
  sums[1] = hn::Add(sums[1], row[1]);
  sums[2] = hn::MulAdd(y, row[0], sums[2]);
}

template <std::size_t kCount>
HWY_INLINE void clear(Vec (&sums)[kCount]) {
  for (Vec& v : sums) v = hn::Zero(Floats());
}
template <std::size_t kCount>
HWY_INLINE void store(const Vec (&sums)[kCount], std::array<float, kCount>& out) {
  for (std::size_t k = 0; k < kCount; ++k) out[k] = total(sums[k]);
}

AffineSums AffineSumsOf(const ImagePair& images, const Region& region, const Affine& motion) {
  const Floats d;
  alignas(64) float line[kMaxAffineSide + 64];
  const Frame frame = frame_of(images);
  const Vec x = hn::Mul(hn::Sub(hn::Iota(d, static_cast<float>(region.column)), hn::Set(d, frame.middle_x)),
                        hn::Set(d, frame.unit));
  const Vec x_step = hn::Set(d, static_cast<float>(lanes()) * frame.unit);
  const bool plain = motion.xx == 0.f && motion.xy == 0.f && motion.yx == 0.f && motion.yy == 0.f;
  float weight_x = 0;
  for (int c = 0; c < region.columns; ++c) weight_x += region.weight_x[c];
  LaneSums lane;
  clear(lane.gxx), clear(lane.gxy), clear(lane.gyy), clear(lane.gxe), clear(lane.gye);
  lane.ee = hn::Zero(d);
  AffineSums sums;
  for (int r = 0; r < region.rows; r += 2) {
    const int row = region.row + r;
    if (plain)
      shifted_row(images, region.column, row, region.columns, motion.dx, motion.dy, line);
    else
      warped_row(images, region.column, row, region.columns, motion, line);
    const float* a = images.first + static_cast<std::ptrdiff_t>(row) * images.pitch + region.column;
    const RowSums s = row_sums(images, a, line, region, region.weight_y[r], x, x_step);
    const Vec y = hn::Set(d, (static_cast<float>(row) - frame.middle_y) * frame.unit), yy = hn::Mul(y, y);
    add_square(s.gxx, y, yy, lane.gxx);
    add_square(s.gxy, y, yy, lane.gxy);
    add_square(s.gyy, y, yy, lane.gyy);
    add_line(s.gxe, y, lane.gxe);
    add_line(s.gye, y, lane.gye);
    lane.ee = hn::Add(lane.ee, s.ee);
    sums.weight += region.weight_y[r] * weight_x;
  }
  store(lane.gxx, sums.gxx);
  store(lane.gxy, sums.gxy);
  store(lane.gyy, sums.gyy);
  store(lane.gxe, sums.gxe);
  store(lane.gye, sums.gye);
  sums.ee = total(lane.ee);
  return sums;
}

}  // namespace HWY_NAMESPACE
}  // namespace wasp::vision::shift
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace wasp::vision::shift {

HWY_EXPORT(AffineSumsOf);

AffineSums affine_sums(const ImagePair& images, const Region& region, const Affine& motion) noexcept {
  return HWY_DYNAMIC_DISPATCH(AffineSumsOf)(images, region, motion);
}

}  // namespace wasp::vision::shift
#endif  // HWY_ONCE
