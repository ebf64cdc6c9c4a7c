// distort() is (D.12, D.13) as printed; undistort() solves distort(ideal) = seen with the exact 2x2 Jacobian.
#include "vision/kernels/camera_model.h"

#include <cmath>

namespace wasp::vision {
namespace {

struct Jacobian {
  float xx, xy, yx, yy;  ///< d(seen x)/d(ideal x) ...
};

Jacobian jacobian(const Intrinsics& k, Ray p) noexcept {
  const float r2 = p.x * p.x + p.y * p.y;
  const float radial = 1.f + r2 * (k.k1 + r2 * (k.k2 + r2 * k.k3));
  const float slope = 2.f * (k.k1 + r2 * (2.f * k.k2 + r2 * 3.f * k.k3));  // d radial / d(r^2), twice
  const float cross = p.x * p.y * slope + 2.f * (k.p1 * p.x + k.p2 * p.y);
  return {radial + p.x * p.x * slope + 2.f * k.p1 * p.y + 6.f * k.p2 * p.x, cross, cross,
          radial + p.y * p.y * slope + 6.f * k.p1 * p.y + 2.f * k.p2 * p.x};
}

}  // namespace

bool usable(const Intrinsics& k) noexcept {
  const float sum = k.fx_px + k.fy_px + k.cx_px + k.cy_px + k.k1 + k.k2 + k.p1 + k.p2 + k.k3;
  return k.width_px > 0 && k.height_px > 0 && k.fx_px > 0.f && k.fy_px > 0.f && std::isfinite(sum);
}

bool distorted(const Intrinsics& k) noexcept {
  return k.k1 != 0.f || k.k2 != 0.f || k.p1 != 0.f || k.p2 != 0.f || k.k3 != 0.f;
}

Ray distort(const Intrinsics& k, Ray p) noexcept {
  const float r2 = p.x * p.x + p.y * p.y, xy = p.x * p.y;
  const float radial = 1.f + r2 * (k.k1 + r2 * (k.k2 + r2 * k.k3));
  return {p.x * radial + 2.f * k.p1 * xy + k.p2 * (r2 + 2.f * p.x * p.x),
          p.y * radial + k.p1 * (r2 + 2.f * p.y * p.y) + 2.f * k.p2 * xy};
}

bool undistort(const Intrinsics& k, Ray seen, Ray& ideal) noexcept {
  ideal = seen;
  if (!distorted(k)) return true;
  for (int i = 0; i < kMaxNewton; ++i) {
    const Ray now = distort(k, ideal);
    const float ex = seen.x - now.x, ey = seen.y - now.y;
    if (std::abs(ex) + std::abs(ey) < 1e-6f) return true;
    const Jacobian j = jacobian(k, ideal);
    const float det = j.xx * j.yy - j.xy * j.yx;
    if (!(det > 0.05f)) return false;  // the polynomial folds back here
    ideal.x += (j.yy * ex - j.xy * ey) / det;
    ideal.y += (j.xx * ey - j.yx * ex) / det;
  }
  const Ray now = distort(k, ideal);
  return std::abs(seen.x - now.x) + std::abs(seen.y - now.y) < 1e-6f;
}

Pixel project(const Intrinsics& k, Ray ray) noexcept {
  const Ray seen = distort(k, ray);
  return {k.fx_px * seen.x + k.cx_px, k.fy_px * seen.y + k.cy_px};
}

bool unproject(const Intrinsics& k, Pixel pixel, Ray& ray) noexcept {
  return undistort(k, {(pixel.u_px - k.cx_px) / k.fx_px, (pixel.v_px - k.cy_px) / k.fy_px}, ray);
}

bool attitude_usable(const std::array<float, 4>& q) noexcept {
  const float norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return norm > 0.95f && norm < 1.05f;  // false for NaN
}

Vec3 up_in_camera(const CameraGeometry& geometry, const std::array<float, 4>& q) noexcept {
  const Quat q_ned_body = attitude_usable(q) ? Quat(q[0], q[1], q[2], q[3]).normalized() : Quat::Identity();
  const Vec3 up_cam = geometry.R_body_cam.transpose() * (q_ned_body.conjugate() * Vec3(0.f, 0.f, -1.f));
  return up_cam;
}

HorizonRow horizon_row(const Intrinsics& k, const Vec3& up_cam) noexcept {
  // Rays on the horizon are at right angles to up: up . (0, y, 1) = 0.
  constexpr float kLeast = 0.17f;  // sin 10 degrees
  if (!(up_cam.y() < -kLeast)) return {};
  return {k.cy_px + k.fy_px * (-up_cam.z() / up_cam.y()), true};
}

}  // namespace wasp::vision
