// Height from where edges are, and how many: horizontal edges on the floor as a Poisson process (thesis section 7.2).
//
// Both models below see only the product mu = lambda h (edges per metre times height = edges met while walking one
// height), so the fits are over mu and h = mu / lambda. With s(v) the cotangent of row v's angle below the horizon
// (a point on the floor at that row is h s away), the thesis' x = k / v becomes x = h s, and its model (7.31)
//     f_V(v) ~ |s'(v)| exp(-mu (s(v) - s(v + delta))),   with v_max for v + delta in the last delta rows,
// holds for any pitch; for a level camera s = f / v and it is (7.31) to the letter.
//
// A camera that looks steeply down sees s' nearly the same in all rows: the distribution says nothing. The count
// does. (Derived here, not in the thesis.) A row of height delta sees h |s'| delta of floor, so a column has an edge
// in it with probability p(v) = 1 - exp(-mu |s'(v)| delta); Sobel and blur widen an edge to `edge_thickness_px` rows;
// the expected share of edge pixels is the mean of min(1, thickness p(v)), monotone in mu, solved by bisection.
// Straight down: s' = 1/f, p = 1 - exp(-mu delta / f): edges per pixel grow with height. Heading turns such an image,
// so edges of any direction are counted; lambda is then metres of edge per square metre, and the form is the same.
#pragma once

#include <cstdint>

#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/edge_rows.h"

namespace wasp::vision {

enum class EdgeModel : std::uint8_t { kAuto, kDistribution, kCount };

struct EdgeHeightParams {
  float edges_per_m = 1.5f;        ///< lambda: 0.35 in the thesis' virtual world, 3.1 indoors, 1.5 outdoors
  float resolution_px = 2.f;       ///< delta: rows within which a second edge is not seen
  float edge_thickness_px = 2.5f;  ///< rows one edge lights up: 2 for an ideal step under Sobel, more with blur
  float min_height_m = 0.1f, max_height_m = 20.f;
  float horizon_margin_rad = 0.03f;  ///< rows closer below the horizon than this are not floor for sure
  std::int32_t min_edges = 200;      ///< fewer edge pixels: blind
  EdgeModel model = EdgeModel::kAuto;
};

struct EdgeHeight {
  bool valid = false;
  EdgeModel model = EdgeModel::kDistribution;  ///< the one used
  float height_m = 0;
  float height_sigma_m = 0;           ///< spread seen in practice plus misfit; not a derived error
  float edges_per_height = 0;         ///< mu; divide by a known height to calibrate lambda
  float mode_height_m = 0;            ///< (7.36) from the row of most edges; 0 where it does not apply
  float misfit = 0;                   ///< largest gap between the two distributions, 0 ... 1 (count model: 0)
  float edge_share = 0;               ///< edge pixels / floor pixels
  int first_row_px = 0, rows_px = 0;  ///< rows taken as floor
};

/// Which model and which kind of edge a camera held like this calls for: rows of horizontal edges where the rows'
/// ground footprints differ enough from top to bottom, the count of edges of any direction where they do not.
EdgeModel suitable_model(const EdgeHeightParams& params, const Intrinsics& intrinsics,
                         const Vec3& up_cam) WASP_REALTIME;
inline EdgeKind suitable_kind(EdgeModel model) WASP_REALTIME {
  return model == EdgeModel::kCount ? EdgeKind::kAnyDirection : EdgeKind::kHorizontal;
}

/// `up_cam` is the unit world up in camera axes; roll is taken as small. Invalid when edges are few, no row shows
/// floor, the answer sits on a bound, or a parameter makes no sense. Constant trip counts. Realtime-safe: yes.
EdgeHeight estimate_edge_height(const EdgeHeightParams& params, const Intrinsics& intrinsics, const Vec3& up_cam,
                                const EdgeRows& rows) WASP_REALTIME;

}  // namespace wasp::vision
