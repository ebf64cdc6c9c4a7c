// Sums run in four lanes written out as vectors: fast at any optimisation level, and the same result whatever the
// compiler chooses, because the order of additions is fixed here.
#include "vision/kernels/plane_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>

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

/// Four floats at once: a vector register wherever there is one (GCC and clang vector extension).
using Lane [[gnu::vector_size(16)]] = float;

Lane load(const float* p) noexcept {
  Lane lane;
  std::memcpy(&lane, p, sizeof lane);
  return lane;
}

double total(Lane lane) noexcept {
  const auto at = [&lane](int l) { return static_cast<double>(lane[l]); };
  return (at(0) + at(1)) + (at(2) + at(3));
}

/// Moments of the inliers and their residuals against the start plane (w itself never enters squared, so float sums
/// keep their precision): n, x, y, r, xx, xy, yy, xr, yr, rr, and the squares of r / w for perpendicular distances.
struct Moments {
  Lane n{}, x{}, y{}, r{}, xx{}, xy{}, yy{}, xr{}, yr{}, rr{}, dd{};

  void add(Lane px, Lane py, Lane pw, const InversePlane& p, const Band& band) noexcept {
    const Lane pr = pw - (p.a * px + p.b * py + p.c), tolerance = band.sensor + band.slope * pw;
    const Lane on = ((pr < tolerance) & (pr > -tolerance)) ? Lane{1.f, 1.f, 1.f, 1.f} : Lane{};
    const Lane ox = on * px, oy = on * py, residual = on * pr, distance = residual / pw;
    n += on;
    x += ox;
    y += oy;
    r += residual;
    xx += ox * px;
    xy += ox * py;
    yy += oy * py;
    xr += ox * pr;
    yr += oy * pr;
    rr += residual * pr;
    dd += distance * distance;
  }
};

/// Points that fill up the last lane: far above any plane, so never counted.
constexpr float kPadding_per_m = 1e6f;

Moments moments(const InverseDepths& points, const InversePlane& p, const Band& band) noexcept {
  Moments m;
  const std::size_t n = points.w.size(), whole = n - n % kLanes;
  const float *x = points.x.data(), *y = points.y.data(), *w = points.w.data();
  for (std::size_t i = 0; i < whole; i += kLanes) m.add(load(x + i), load(y + i), load(w + i), p, band);
  Lane last_x{}, last_y{}, last_w{kPadding_per_m, kPadding_per_m, kPadding_per_m, kPadding_per_m};
  for (std::size_t i = whole; i < n; ++i) {
    const int l = static_cast<int>(i - whole);
    last_x[l] = x[i], last_y[l] = y[i], last_w[l] = w[i];
  }
  m.add(last_x, last_y, last_w, p, band);
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
  const double mx = total(m.x) / n, my = total(m.y) / n, mr = total(m.r) / n;
  const double xx = total(m.xx) / n - mx * mx, xy = total(m.xy) / n - mx * my, yy = total(m.yy) / n - my * my;
  const double xr = total(m.xr) / n - mx * mr, yr = total(m.yr) / n - my * mr;
  const double det = xx * yy - xy * xy;
  if (!(det > 1e-9)) return fit;
  const double da = (xr * yy - yr * xy) / det, db = (yr * xx - xr * xy) / det;
  fit.plane.a = start.a + static_cast<float>(da);
  fit.plane.b = start.b + static_cast<float>(db);
  fit.plane.c = start.c + static_cast<float>(mr - da * mx - db * my);
  const double left = std::max(0.0, total(m.rr) / n - mr * mr - da * xr - db * yr);  // residual variance after the fit
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
