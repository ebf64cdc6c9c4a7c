// The focus of expansion: where the image flow of a translating camera points away from (5.4.1).
//  - printed (5.11, 5.12): the column with the least mean u^2, the row with the least mean v^2. Right only for a
//    frontal surface at one depth, resolved to one cell; kept as the reference.
//  - default: the point e that leaves the least flow across the directions p - e, sum rho(f . n(e)), n(e) normal to
//    p - e. The residual is the flow noise of one axis whatever the depth of the cell, so no cell is favoured. Start:
//    consensus over intersections of pairs of flow lines; then Gauss-Newton with Tukey weights. With `rotation` the
//    camera's own small turn is solved for together (5 unknowns); the start is then a search over a grid of e.
// Fixed trip counts. The flow should be free of rotation (derotate.h) unless it is solved for.
#pragma once

#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/flow_field.h"

namespace wasp::vision {

inline constexpr int kFoeTrials = 96;
inline constexpr int kFoeRounds = 12;

struct FoeParams {
  float flow_sigma_px = 0.05f;  ///< least credible noise of one cell and axis
  float inlier_px = 2.f;        ///< across-flow beyond which a cell does not follow the motion: room for a gyro that
                                ///< leaves 2 or 3 mrad; noise has its own, robust scale
  float max_sigma_px = 60.f;    ///< a less certain e is invalid
  int min_cells = 12;
  float min_inlier_share = 0.5f;
};

struct Foe {
  bool valid = false;
  float x_px = 0, y_px = 0;
  bool expanding = true;  ///< false: focus of contraction, the camera moves backwards
  float sigma_px = 0;     ///< larger semi-axis of e's 1-sigma ellipse, from the residuals
  float residual_px = 0;  ///< rms flow across the directions from e, over the inliers
  int cells = 0, inliers = 0;
  Vec3 rotation_rad = Vec3::Zero();  ///< camera's turn from frame to frame, camera axes; only where solved for
};

/// (5.11, 5.12): centre of the column (row) of least mean u^2 (v^2). Columns and rows without a valid cell do not
/// count; invalid with fewer than `params.min_cells` valid cells. sigma, residual and inliers stay 0. Realtime-safe:
/// yes.
Foe printed_foe(const FoeParams& params, const FlowField& flow) WASP_REALTIME;

/// Robust least squares; the camera does not turn, or its turn has been taken out. Realtime-safe: yes.
Foe find_foe(const FoeParams& params, const FlowField& flow) WASP_REALTIME;

/// The same with the camera's turn solved for (no distortion: cells in pinhole pixels). Needs depth variation or a
/// wide view; the sigma says when it has neither. Realtime-safe: yes.
Foe find_foe_and_rotation(const FoeParams& params, const FlowField& flow, const Intrinsics& intrinsics) WASP_REALTIME;

}  // namespace wasp::vision
