// Sums run in four independent lanes, so that the compiler may vectorise them without changing the result, and the
// result does not depend on the compiler's choice.
#include "vision/kernels/plane_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

constexpr float kBelowTolerances = 1.5f;
constexpr std::size_t kLanes = 4;

/// Tolerance in w of a sample at inverse depth w: sensor + slope * w.
struct Band {
  float sensor, slope;
  Band(const InversePlane& plane, const PlaneTolerance& t) noexcept
      : sensor(t.sensor_per_m), slope(t.flatness_m * plane.gradient().norm()) {}
};

using Lane = std::array<float, kLanes>;

/// Moments of the inliers about the origin: n, x, y, w, xx, xy, yy, xw, yw, ww, and the perpendicular residuals' sum.
struct Moments {
  Lane n{}, x{}, y{}, w{}, xx{}, xy{}, yy{}, xw{}, yw{}, ee{}, dd{};
};

double total(const Lane& lane) noexcept {
  const auto at = [&lane](std::size_t l) { return static_cast<double>(lane[l]); };
  return (at(0) + at(1)) + (at(2) + at(3));
}

/// Residuals are taken against `p` (w itself never enters squared), so float sums keep their precision.
void add(Moments& m, std::size_t l, float x, float y, float w, const InversePlane& p, const Band& band) noexcept {
  const float r = w - (p.a * x + p.b * y + p.c);
  const float on = std::abs(r) < band.sensor + band.slope * w ? 1.f : 0.f;
  const float ox = on * x, oy = on * y, orr = on * r, d = r / w;
  m.n[l] += on;
  m.x[l] += ox;
  m.y[l] += oy;
  m.w[l] += orr;
  m.xx[l] += ox * x;
  m.xy[l] += ox * y;
  m.yy[l] += oy * y;
  m.xw[l] += ox * r;
  m.yw[l] += oy * r;
  m.ee[l] += orr * r;
  m.dd[l] += on * d * d;
}

Moments moments(const InverseDepths& points, const InversePlane& p, const Band& band) noexcept {
  Moments m;
  const std::size_t n = points.w.size(), whole = n - n % kLanes;
  const float *x = points.x.data(), *y = points.y.data(), *w = points.w.data();
  for (std::size_t i = 0; i < whole; i += kLanes)
    for (std::size_t l = 0; l < kLanes; ++l) add(m, l, x[i + l], y[i + l], w[i + l], p, band);
  for (std::size_t i = whole; i < n; ++i) add(m, i - whole, x[i], y[i], w[i], p, band);
  return m;
}

}  // namespace

float InversePlane::height_m() const noexcept { return 1.f / gradient().norm(); }

Vec3 InversePlane::normal_cam() const noexcept { return -gradient() * height_m(); }

PlaneSupport count_support(const InverseDepths& points, const InversePlane& p, const PlaneTolerance& t) noexcept {
  const Band band(p, t);
  const std::size_t n = points.w.size();
  const float *x = points.x.data(), *y = points.y.data(), *w = points.w.data();
  int inliers = 0, below = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const float r = w[i] - (p.a * x[i] + p.b * y[i] + p.c);
    const float tolerance = band.sensor + band.slope * w[i];
    inliers += std::abs(r) < tolerance ? 1 : 0;
    below += r < -kBelowTolerances * tolerance ? 1 : 0;
  }
  return {inliers, below};
}

bool plane_through(const InverseDepths& points, std::array<int, 3> index, float min_area, InversePlane& out) noexcept {
  const auto i = static_cast<std::size_t>(index[0]), j = static_cast<std::size_t>(index[1]),
             k = static_cast<std::size_t>(index[2]);
  const float x1 = points.x[j] - points.x[i], y1 = points.y[j] - points.y[i], w1 = points.w[j] - points.w[i];
  const float x2 = points.x[k] - points.x[i], y2 = points.y[k] - points.y[i], w2 = points.w[k] - points.w[i];
  const float det = x1 * y2 - x2 * y1;
  if (!(std::abs(det) >= min_area) || det == 0.f) return false;
  out.a = (w1 * y2 - w2 * y1) / det;
  out.b = (x1 * w2 - x2 * w1) / det;
  out.c = points.w[i] - out.a * points.x[i] - out.b * points.y[i];
  return true;
}

PlaneFit fit_inliers(const InverseDepths& points, const InversePlane& start, const PlaneTolerance& t) noexcept {
  PlaneFit fit;
  const Moments m = moments(points, start, Band(start, t));
  const double n = total(m.n);
  fit.inliers = static_cast<int>(n);
  if (fit.inliers < 8) return fit;
  const double mx = total(m.x) / n, my = total(m.y) / n, mr = total(m.w) / n;
  const double xx = total(m.xx) / n - mx * mx, xy = total(m.xy) / n - mx * my, yy = total(m.yy) / n - my * my;
  const double xr = total(m.xw) / n - mx * mr, yr = total(m.yw) / n - my * mr;
  const double det = xx * yy - xy * xy;
  if (!(det > 1e-9)) return fit;
  const double da = (xr * yy - yr * xy) / det, db = (yr * xx - xr * xy) / det;
  fit.plane.a = start.a + static_cast<float>(da);
  fit.plane.b = start.b + static_cast<float>(db);
  fit.plane.c = start.c + static_cast<float>(mr - da * mx - db * my);
  const double left = std::max(0.0, total(m.ee) / n - mr * mr - da * xr - db * yr);  // residual variance after the fit
  const double height = fit.plane.height_m();
  if (!std::isfinite(height)) return fit;
  // Covariance of (a, b, c) = variance * inverse normal matrix, from the centred moments.
  Eigen::Matrix3d normal;
  normal << xx + mx * mx, xy + mx * my, mx, xy + mx * my, yy + my * my, my, mx, my, 1.0;
  const Eigen::Matrix3d covariance = (left / std::max(n - 3.0, 1.0)) * normal.inverse();
  const Eigen::Vector3d unit = fit.plane.normal_cam().cast<double>();
  const double along = std::max(0.0, unit.dot(covariance * unit));
  const double across = std::max(0.0, covariance.trace() - along);
  fit.rms_per_m = static_cast<float>(std::sqrt(left));
  fit.rms_m = static_cast<float>(height * std::sqrt(total(m.dd) / n));  // d = h z r = h r / w, against `start`
  fit.height_sigma_m = static_cast<float>(height * height * std::sqrt(along));
  fit.normal_sigma_rad = static_cast<float>(height * std::sqrt(across));
  fit.valid = true;
  return fit;
}

}  // namespace wasp::vision
