// Cells to the level plane, similarity fit, signs.
#include "vision/heading_rate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "vision/kernels/flow_view.h"

namespace wasp::vision {
namespace {

/// Level axes as a camera's that looks down with its top to the front: what fit and signs of the kernel mean.
FlowView level_view(const HeadingRateDown::Params& p, const FlowFrames& frames) noexcept {
  const CameraGeometry& camera = p.camera;
  const Mat3 R_view_level = R_body_cam_from_pitch_down(Radians{std::numbers::pi / 2}).transpose();
  return {.R_view_first = R_view_level * frames.R_level_first * camera.R_body_cam,
          .R_view_second = R_view_level * frames.R_level_second * camera.R_body_cam,
          .focal_px = std::sqrt(camera.intrinsics.fx_px * camera.intrinsics.fy_px),
          .max_angle_rad = p.max_angle_rad};
}

}  // namespace

void speak_heading(const HeadingRate& turn, float scale, float gain, float interval_s, CueBody& cue) noexcept {
  const float rate_radps = scale * turn.yaw_rad / interval_s;
  cue.detail[HeadingDetail::kYawRate_radps] = rate_radps;
  cue.detail[HeadingDetail::kYawRateSigma_radps] = scale * turn.yaw_sigma_rad / interval_s;
  cue.detail[HeadingDetail::kHeightRatio] = turn.height_ratio;
  cue.detail[HeadingDetail::kHeightRatioSigma] = turn.height_ratio_sigma;
  if (!std::isfinite(rate_radps)) return;
  cue.validity = Validity::kValid;
  if (!(gain > 0.f)) return;
  cue.has_heading_rate = 1;
  cue.heading_rate_radps = -gain * rate_radps;
}

CueBody HeadingRateDown::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  if (input.flow == nullptr) return cue;
  const FlowMessage& message = *input.flow;
  const FlowFrames frames = frames_of(message, params.camera.R_body_cam);
  if (!frames.valid) return cue;
  FlowField level;
  view_flow(params.camera.lens(), message.seen, level_view(params, frames), level);
  const SimilarityFit fit = fit_similarity({.centre_x_px = 0.f,
                                            .centre_y_px = 0.f,
                                            .inlier_px = params.inlier_px,
                                            .min_cells = params.min_cells,
                                            .min_inlier_share = params.min_inlier_share},
                                           level);
  cue.detail[kCells] = static_cast<float>(fit.cells);
  cue.detail[kInliers] = static_cast<float>(fit.inliers);
  cue.detail[kResidual_px] = fit.residual_px;
  cue.detail[kHeading_rad] = static_cast<float>(state.heading_rad);
  const HeadingRate turn = heading_from_fit(fit, params.max_sigma);
  if (!turn.valid) return cue;
  if (!state.has_last || message.exposed_at_ns > state.last_at_ns)
    state.heading_rad += static_cast<double>(params.scale * turn.yaw_rad);
  state.has_last = true;
  state.last_at_ns = message.exposed_at_ns;
  cue.detail[kHeading_rad] = static_cast<float>(state.heading_rad);
  cue.quality = fit.cells > 0 ? static_cast<float>(fit.inliers) / static_cast<float>(fit.cells) : 0.f;
  speak_heading(turn, params.scale, params.gain, frames.interval_s, cue);
  return cue;
}

}  // namespace wasp::vision
