// Normal equations from the moments of vision/kernels/plane_passes.h, in double.
#include "vision/kernels/plane_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "vision/kernels/plane_passes.h"

namespace wasp::vision {
namespace {

constexpr double kMinInliers = 8;

PlaneBand band_of(const InversePlane& plane, const PlaneTolerance& t) noexcept {
  return {t.sensor_per_m, t.flatness_m * plane.gradient().norm()};
}

/// Means and central moments of the inliers, and the correction of the start plane they ask for.
struct Normal {
  double mx, my, mr, xx, xy, yy, xr, yr, da = 0, db = 0;

  explicit Normal(const PlaneMoments& m) noexcept
      : mx(m.x / m.n),
        my(m.y / m.n),
        mr(m.r / m.n),
        xx(m.xx / m.n - mx * mx),
        xy(m.xy / m.n - mx * my),
        yy(m.yy / m.n - my * my),
        xr(m.xr / m.n - mx * mr),
        yr(m.yr / m.n - my * mr) {}

  bool solve() noexcept {
    const double det = xx * yy - xy * xy;
    da = (xr * yy - yr * xy) / det;
    db = (yr * xx - xr * xy) / det;
    return det > 1e-9;
  }
  [[nodiscard]] InversePlane applied_to(const InversePlane& start) const noexcept {
    return {start.a + static_cast<float>(da), start.b + static_cast<float>(db),
            start.c + static_cast<float>(mr - da * mx - db * my)};
  }
};

}  // namespace

float InversePlane::height_m() const noexcept { return 1.f / gradient().norm(); }

Vec3 InversePlane::normal_cam() const noexcept { return -gradient() * height_m(); }

PlaneSupport count_support(const InverseDepths& points, const InversePlane& p, const PlaneTolerance& t) noexcept {
  return pass_support(points, p, band_of(p, t));
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

bool refine(const InverseDepths& points, const PlaneTolerance& t, InversePlane& plane) noexcept {
  const PlaneMoments m = pass_moments(points, plane, band_of(plane, t), false);
  if (m.n < kMinInliers) return false;
  Normal normal(m);
  if (!normal.solve()) return false;
  plane = normal.applied_to(plane);
  return std::isfinite(plane.height_m());
}

PlaneFit fit_inliers(const InverseDepths& points, const InversePlane& start, const PlaneTolerance& t) noexcept {
  PlaneFit fit;
  const PlaneMoments m = pass_moments(points, start, band_of(start, t), true);
  fit.inliers = static_cast<int>(m.n);
  if (m.n < kMinInliers) return fit;
  Normal e(m);
  if (!e.solve()) return fit;
  fit.plane = e.applied_to(start);
  const double left = std::max(0.0, m.rr / m.n - e.mr * e.mr - e.da * e.xr - e.db * e.yr);  // variance after the fit
  const double height = static_cast<double>(fit.plane.height_m());
  if (!std::isfinite(height)) return fit;
  // Covariance of (a, b, c) = variance * inverse normal matrix.
  Eigen::Matrix3d normal;
  normal << e.xx + e.mx * e.mx, e.xy + e.mx * e.my, e.mx, e.xy + e.mx * e.my, e.yy + e.my * e.my, e.my, e.mx, e.my, 1.0;
  const Eigen::Matrix3d covariance = (left / std::max(m.n - 3.0, 1.0)) * normal.inverse();
  const Eigen::Vector3d unit = fit.plane.normal_cam().cast<double>();
  const double along = std::max(0.0, unit.dot(covariance * unit));
  const double across = std::max(0.0, covariance.trace() - along);
  fit.rms_per_m = static_cast<float>(std::sqrt(left));
  fit.rms_m = static_cast<float>(height * std::sqrt(m.dd / m.n));  // d = h z r = h r / w, against `start`
  fit.height_sigma_m = static_cast<float>(height * height * std::sqrt(along));
  fit.normal_sigma_rad = static_cast<float>(height * std::sqrt(across));
  fit.valid = true;
  return fit;
}

}  // namespace wasp::vision
