#include "vision/kernels/flow_grid_solve.h"

namespace wasp::vision {
namespace {

using Vec = std::array<float, 3>;

/// Symmetric 3 x 3: (0,0) (0,1) (0,2) (1,1) (1,2) (2,2).
using Symmetric = std::array<float, 6>;

inline Vec times(const Symmetric& m, const Vec& x) noexcept {
  return {m[0] * x[0] + m[1] * x[1] + m[2] * x[2], m[1] * x[0] + m[3] * x[1] + m[4] * x[2],
          m[2] * x[0] + m[4] * x[1] + m[5] * x[2]};
}

inline bool inverse(const Symmetric& m, Symmetric& out) noexcept {
  const float c0 = m[3] * m[5] - m[4] * m[4], c1 = m[2] * m[4] - m[1] * m[5], c2 = m[1] * m[4] - m[2] * m[3];
  const float det = m[0] * c0 + m[1] * c1 + m[2] * c2;
  if (!(det > 0.f)) return false;
  const float f = 1.f / det;
  out = {c0 * f,
         c1 * f,
         c2 * f,
         (m[0] * m[5] - m[2] * m[2]) * f,
         (m[1] * m[2] - m[0] * m[4]) * f,
         (m[0] * m[3] - m[1] * m[1]) * f};
  return true;
}

/// c - b a b, symmetric.
inline Symmetric schur(const Symmetric& c, const Symmetric& b, const Symmetric& a) noexcept {
  const Vec r0 = times(a, {b[0], b[1], b[2]}), r1 = times(a, {b[1], b[3], b[4]}), r2 = times(a, {b[2], b[4], b[5]});
  return {c[0] - (b[0] * r0[0] + b[1] * r0[1] + b[2] * r0[2]), c[1] - (b[0] * r1[0] + b[1] * r1[1] + b[2] * r1[2]),
          c[2] - (b[0] * r2[0] + b[1] * r2[1] + b[2] * r2[2]), c[3] - (b[1] * r1[0] + b[3] * r1[1] + b[4] * r1[2]),
          c[4] - (b[1] * r2[0] + b[3] * r2[1] + b[4] * r2[2]), c[5] - (b[2] * r2[0] + b[4] * r2[1] + b[5] * r2[2])};
}

/// Sums are in the order 1, x, y, xx, xy, yy: the same as Symmetric's.
inline Symmetric matrix(const std::array<float, 8>& sums, float shift, float affine) noexcept {
  return {sums[0] + shift, sums[1], sums[2], sums[3] + affine, sums[4], sums[5] + affine};
}

}  // namespace

bool solve_affine_step(const BlockSums& sums, const std::array<float, 2>& off, const CellMotion& motion, float shift,
                       float affine, AffineStep& out) noexcept {
  const Symmetric a = matrix(sums.xx, shift, affine), b = matrix(sums.xy, 0.f, 0.f), c = matrix(sums.yy, shift, affine);
  const float pull = affine * kAffineScalePx;
  const Vec p = {-sums.bu[0] - shift * off[0], -sums.bu[1] - pull * motion.du_dx, -sums.bu[2] - pull * motion.du_dy};
  const Vec q = {-sums.bv[0] - shift * off[1], -sums.bv[1] - pull * motion.dv_dx, -sums.bv[2] - pull * motion.dv_dy};
  Symmetric a_inverse, s_inverse;
  if (!inverse(a, a_inverse) || !inverse(schur(c, b, a_inverse), s_inverse)) return false;
  const Vec ap = times(a_inverse, p), bap = times(b, ap);
  out.v = times(s_inverse, {q[0] - bap[0], q[1] - bap[1], q[2] - bap[2]});
  const Vec bv = times(b, out.v);
  out.u = times(a_inverse, {p[0] - bv[0], p[1] - bv[1], p[2] - bv[2]});
  return true;
}

}  // namespace wasp::vision
