// The camera's translation between two frames from flow and depth. A still point at depth X along the ray e = (x, y) is
// seen along e' once the camera has moved by t and its turn is taken out: X (e' - e) = t_z e' - t_xy, exactly. Divided
// by X these are two equations a cell, in units of flow, linear in t and in what is left of the turn (a small rotation
// w with a prior): e' - e = (t_z e' - t_xy) / X + turn flow(e) w. Consensus over pairs of cells starts; least squares
// with Tukey's weights polishes. Fixed trip counts. Derived here from (6.10), (6.11); see flow_depth.h for the
// converse.
#pragma once

#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/flow_field.h"

namespace wasp::vision {

inline constexpr int kMotionTrials = 64;
inline constexpr int kMotionRounds = 8;

struct FlowMotionParams {
  float flow_sigma_px = 0.1f;       ///< least credible noise of one cell and axis
  float depth_sigma = 0.01f;        ///< of the depth: this share of it ...
  float depth_sigma_1pm = 0.0015f;  ///< ... and this times its square [1/m]
  float min_depth_m = 0.3f, max_depth_m = 8.f;
  float inlier_sigmas = 10.f;     ///< of the expected error, beyond which a cell does not follow the motion
  float turn_sigma_rad = 0.002f;  ///< prior of what is left of the turn, each axis; 0: nothing is
  int min_inliers = 10;           ///< >= 4
  float min_inlier_share = 0.5f;
};

struct FlowMotion {
  bool valid = false;
  Vec3 moved_m = Vec3::Zero();        ///< of the camera, in its axes at the first frame
  Mat3 covariance_m2 = Mat3::Zero();  ///< of moved_m, from the residuals
  Vec3 turn_left_rad = Vec3::Zero();  ///< the camera's turn beyond the one taken out, its axes
  float residual = 0;                 ///< rms over the inliers and both axes, in units of the expected error
  int cells = 0, inliers = 0;         ///< cells with flow and depth; those that agree
};

using CellDepths = std::array<float, FlowField::kMaxColumns * FlowField::kMaxRows>;

/// `still`: flow without the camera's turn. `depth_m`: along the optical axis at the cells' centres in the first frame,
/// anything out of range (0, NaN) unknown. Invalid for a bad field, lens or parameters, or without agreement.
/// Realtime-safe: yes.
FlowMotion flow_motion(const FlowMotionParams& params, const Lens& lens, const FlowField& still,
                       const CellDepths& depth_m) WASP_REALTIME;

}  // namespace wasp::vision
