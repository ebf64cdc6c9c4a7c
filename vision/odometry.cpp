// Camera's displacement, to the body's, to level axes, over the interval.
#include "vision/odometry.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/camera_model.h"
#include "vision/kernels/derotate.h"
#include "vision/kernels/flow_motion.h"
#include "vision/kernels/flow_view.h"

namespace wasp::vision {
namespace {

FlowMotionParams motion_params(const Odometry::Params& p) noexcept {
  return {.flow_sigma_px = p.flow_sigma_px,
          .depth_sigma = p.depth_sigma,
          .depth_sigma_1pm = p.depth_sigma_1pm,
          .min_depth_m = p.min_depth_m,
          .max_depth_m = p.max_depth_m,
          .inlier_sigmas = p.inlier_sigmas,
          .turn_sigma_rad = p.turn_sigma_rad,
          .min_inliers = p.min_inliers,
          .min_inlier_share = p.min_inlier_share};
}

/// Mean angle between the two directions of each valid cell.
float image_motion_rad(const Lens& lens, const FlowField& still) noexcept {
  float sum = 0, cells = 0;
  for (int i = 0; i < still.count(); ++i) {
    const FlowCell& cell = still.cells[static_cast<std::size_t>(i)];
    Vec3 a, b;
    if (cell.valid == 0 || !direction_of(lens, {cell.x_px, cell.y_px}, a) ||
        !direction_of(lens, {cell.x_px + cell.u_px, cell.y_px + cell.v_px}, b))
      continue;
    const float angle_rad = 2.f * std::atan2((b - a).norm(), (b + a).norm());
    if (!std::isfinite(angle_rad)) continue;
    sum += angle_rad, cells += 1.f;
  }
  return cells > 0.f ? sum / cells : 0.f;
}

/// True once for each message: a message that is not later than the last one moves no odometer.
bool is_new(const FlowMessage& message, Odometry::State& state) noexcept {
  const bool later = !state.has_last || message.exposed_at_ns > state.last_at_ns;
  state.has_last = true;
  state.last_at_ns = message.exposed_at_ns;
  return later;
}

/// The body's displacement in level axes at the second frame. The camera, at r on the body, moved by that of the body
/// and by (R_first_second - 1) r in axes of the first frame.
Vec3 level_displacement_m(const CameraGeometry& camera, const FlowFrames& frames, const Vec3& moved_cam_m) noexcept {
  const Mat3& R_second_first = frames.R_second_first_body;
  const Vec3 lever_m = R_second_first.transpose() * camera.position_body_m - camera.position_body_m;
  return frames.R_level_second * (R_second_first * (camera.R_body_cam * moved_cam_m - lever_m));
}

}  // namespace

CueBody Odometry::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  if (input.flow == nullptr) return cue;
  const FlowMessage& message = *input.flow;
  const CameraGeometry& camera = params.camera;
  const FlowFrames frames = frames_of(message, camera.R_body_cam);
  if (!frames.valid || message.derotated == 0 || !camera.position_body_m.allFinite()) return cue;
  const bool later = is_new(message, state);
  if (later) state.image_motion_rad += static_cast<double>(image_motion_rad(camera.lens(), message.still));
  cue.detail[kImageMotion_rad] = static_cast<float>(state.image_motion_rad);
  cue.detail[kDistance_m] = static_cast<float>(state.distance_m);
  const FlowMotion motion = flow_motion(motion_params(params), camera.lens(), message.still, message.depth_m);
  cue.detail[kCells] = static_cast<float>(motion.cells);
  cue.detail[kInliers] = static_cast<float>(motion.inliers);
  if (!motion.valid) return cue;

  const Vec3 moved_m = level_displacement_m(camera, frames, motion.moved_m);
  const Mat3 R_level_cam = frames.R_level_second * frames.R_second_first_body * camera.R_body_cam;
  const Mat3 covariance_m2 = R_level_cam * motion.covariance_m2 * R_level_cam.transpose();
  const float variance_m2 = std::max(covariance_m2(0, 0), covariance_m2(1, 1));
  const float sigma_mps = std::sqrt(variance_m2) / frames.interval_s;
  cue.detail[kClimb_mps] = -moved_m.z() / frames.interval_s;
  cue.detail[kClimbSigma_mps] = std::sqrt(std::max(covariance_m2(2, 2), 0.f)) / frames.interval_s;
  cue.detail[kResidual_px] = motion.residual * params.flow_sigma_px;
  cue.detail[kTurnLeft_rad] = motion.turn_left_rad.norm();
  if (!moved_m.allFinite() || !(sigma_mps <= params.max_sigma_mps)) return cue;

  const float square = moved_m.head<2>().squaredNorm() - covariance_m2(0, 0) - covariance_m2(1, 1);
  if (later) state.distance_m += std::sqrt(std::max(static_cast<double>(square), 0.0));
  cue.detail[kDistance_m] = static_cast<float>(state.distance_m);
  cue.validity = Validity::kValid;
  cue.has_velocity = 1;
  cue.velocity_forward_mps = moved_m.x() / frames.interval_s;
  cue.velocity_right_mps = moved_m.y() / frames.interval_s;
  cue.velocity_sigma_mps = sigma_mps;
  cue.quality = static_cast<float>(motion.inliers) / static_cast<float>(motion.cells);
  return cue;
}

}  // namespace wasp::vision
