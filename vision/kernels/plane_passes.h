// The passes of the plane finder over its depth samples, in SIMD (Highway, instruction set chosen at run time):
// inverting depths, counting who supports a plane, and the moments of those who do. Every result is the same to the bit
// on every instruction set: counts are exact, sums run in eight fixed lanes, and nothing is fused.
// Realtime-safe: yes, all of it; fixed trip counts.
#pragma once

#include <array>
#include <cstdint>

#include "types/realtime.h"
#include "vision/kernels/depth_samples.h"
#include "vision/kernels/plane_fit.h"

namespace wasp::vision {

/// Tolerance in w of a sample at inverse depth w: sensor + slope * w [1/m].
struct PlaneBand {
  float sensor = 0, slope = 0;
};

/// Sums over the samples within the band of a plane: their number n, rays x and y, residuals r against the plane (w
/// itself never enters squared, so float sums keep their precision), and d = r / w for perpendicular distances.
struct PlaneMoments {
  double n = 0, x = 0, y = 0, r = 0, xx = 0, xy = 0, yy = 0, xr = 0, yr = 0, rr = 0, dd = 0;
};

/// Inliers within the band; below: beyond the plane by more than 1.5 times the band.
PlaneSupport pass_support(const InverseDepths& points, const InversePlane& plane, const PlaneBand& band) WASP_REALTIME;
/// dd stays 0 without `distances`.
PlaneMoments pass_moments(const InverseDepths& points, const InversePlane& plane, const PlaneBand& band,
                          bool distances) WASP_REALTIME;

/// Depths of all cells in millimetres -> inverse depths; those outside min_mm ... max_mm (at least 1) become
/// kAbsent_per_m.
void pass_invert(const std::array<std::uint16_t, kSampleCount>& mm, int min_mm, int max_mm,
                 std::array<float, kSampleCount>& w) WASP_REALTIME;

}  // namespace wasp::vision
