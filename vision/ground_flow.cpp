// Similarity in the level plane, way over height in body axes, turn added.
#include "vision/ground_flow.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "vision/kernels/flow_view.h"

namespace wasp::vision {
namespace {

/// Level axes as a camera's that looks down with its top to the front: x right, y back.
FlowView level_view(const GroundFlow::Params& p, const FlowFrames& frames) noexcept {
  const CameraGeometry& camera = p.camera;
  const Mat3 R_view_level = R_body_cam_from_pitch_down(Radians{std::numbers::pi / 2}).transpose();
  return {.R_view_first = R_view_level * frames.R_level_first * camera.R_body_cam,
          .R_view_second = R_view_level * frames.R_level_second * camera.R_body_cam,
          .focal_px = std::sqrt(camera.intrinsics.fx_px * camera.intrinsics.fy_px),
          .max_angle_rad = p.max_angle_rad};
}

/// The camera's way between the frames over its height at the second, level axes of the second frame.
Vec3 way_over_height(const SimilarityFit& fit, float focal_px) noexcept {
  return {fit.shift_v_px / focal_px, -fit.shift_u_px / focal_px, std::exp(fit.log_scale) - 1.f};
}

/// R_second_first = 1 - [turn]x for a small turn; the sine is put right.
Vec3 turn_of(const Mat3& R) noexcept {
  const Vec3 axis = 0.5f * Vec3(R(1, 2) - R(2, 1), R(2, 0) - R(0, 2), R(0, 1) - R(1, 0));
  const float sine = axis.norm();
  return sine > 1e-6f && sine < 1.f ? Vec3(axis * (std::asin(sine) / sine)) : axis;
}

}  // namespace

CueBody GroundFlow::step(const Params& params, const BehaviourInput& input, State&) noexcept {
  CueBody cue;
  if (input.flow == nullptr || input.flow->derotated == 0) return cue;
  const FlowFrames frames = frames_of(*input.flow, params.camera.R_body_cam);
  if (!frames.valid) return cue;
  const Vec3 down_level = frames.R_level_second.col(2);  // the body's down axis
  if (!(down_level.z() > std::cos(params.max_tilt_rad))) return cue;
  const FlowView view = level_view(params, frames);
  FlowField level;
  view_flow(params.camera.lens(), input.flow->seen, view, level);
  const SimilarityFit fit = fit_similarity({.centre_x_px = 0.f,
                                            .centre_y_px = 0.f,
                                            .inlier_px = params.inlier_px,
                                            .min_cells = params.min_cells,
                                            .min_inlier_share = params.min_inlier_share},
                                           level);
  if (!fit.valid) return cue;
  const Vec3 way_body = frames.R_level_second.transpose() * way_over_height(fit, view.focal_px);
  const Vec3 turn = turn_of(frames.R_second_first_body);
  const float flow_x = turn.x() - way_body.y() * down_level.z(), flow_y = turn.y() + way_body.x() * down_level.z();
  if (!std::isfinite(flow_x + flow_y) || std::abs(flow_x) > 1.f || std::abs(flow_y) > 1.f) return cue;
  cue.validity = Validity::kValid;
  cue.quality = fit.cells > 0 ? static_cast<float>(fit.inliers) / static_cast<float>(fit.cells) : 0.f;
  cue.detail = {flow_x, flow_y, turn.x(), turn.y(), turn.z(), frames.interval_s, 1.f / down_level.z(), fit.residual_px};
  return cue;
}

}  // namespace wasp::vision
