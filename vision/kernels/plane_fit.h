// A plane in (x, y, 1/z): w = a x + b y + c, with (a, b, c) = -n / h for the plane n . X = -h. Counting who lies on it,
// who lies below it, and fitting it to those on it by least squares. All loops run over a fixed budget of samples.
// Derivation: n . z (x, y, 1) = -h  =>  1/z = -(n . (x, y, 1)) / h. The camera is always on the positive side.
// Realtime-safe: yes, all of it.
#pragma once

#include <array>
#include <span>

#include "types/frames.h"
#include "types/realtime.h"

namespace wasp::vision {

struct InversePlane {
  float a = 0, b = 0, c = 0;  ///< [1/m]

  [[nodiscard]] Vec3 gradient() const WASP_REALTIME { return {a, b, c}; }
  /// Distance of the camera centre from the plane [m]; infinite for the plane at infinity.
  [[nodiscard]] float height_m() const WASP_REALTIME;
  /// Unit normal in camera axes, pointing to the camera's side: n . X = -height.
  [[nodiscard]] Vec3 normal_cam() const WASP_REALTIME;
};

/// How far from a plane a sample may lie and still belong to it: k sigma of the sensor, constant in w, plus the
/// unevenness of a real floor (a perpendicular distance d shifts w by d w / h to first order).
struct PlaneTolerance {
  float sensor_per_m = 0.005f;
  float flatness_m = 0.01f;
};

/// Parallel arrays of equal length: rays and inverse depths.
struct InverseDepths {
  std::span<const float> x, y, w;
};

struct PlaneSupport {
  int inliers = 0;  ///< within tolerance
  int below = 0;    ///< beyond the plane by more than 1.5 tolerances: behind or under it
};
PlaneSupport count_support(const InverseDepths& points, const InversePlane& plane,
                           const PlaneTolerance& t) WASP_REALTIME;

/// The plane through three samples; false when their rays are nearly in line (twice the area below `min_area`).
bool plane_through(const InverseDepths& points, std::array<int, 3> index, float min_area,
                   InversePlane& out) WASP_REALTIME;

struct PlaneFit {
  bool valid = false;
  InversePlane plane;
  int inliers = 0;
  float rms_per_m = 0;         ///< of w over the inliers
  float rms_m = 0;             ///< perpendicular, over the inliers
  float height_sigma_m = 0;    ///< from the covariance of the fit, independent residuals assumed
  float normal_sigma_rad = 0;  ///< larger of the two tilts
};

/// Least squares over the samples within tolerance of `start`. Invalid with fewer than 8 of them or when they do not
/// span two directions.
PlaneFit fit_inliers(const InverseDepths& points, const InversePlane& start, const PlaneTolerance& t) WASP_REALTIME;
/// The same plane without its statistics: `plane` becomes the fit of those within tolerance of it. False, and `plane`
/// not to be used, where fit_inliers() would be invalid.
bool refine(const InverseDepths& points, const PlaneTolerance& t, InversePlane& plane) WASP_REALTIME;

}  // namespace wasp::vision
