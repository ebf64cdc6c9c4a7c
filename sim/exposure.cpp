#include "sim/exposure.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "vision/kernels/derotate.h"

namespace wasp::sim {
namespace {

constexpr float kSky_m = 1e4f;
/// How far aside the casts look, in the order of time. They sum to zero, so that nothing shifts, and hardly go along
/// with time, so that no smear grows or shrinks.
constexpr float kAsideOfThree_px[3][2] = {{0.125f, -0.375f}, {0, 0}, {-0.125f, 0.375f}};
constexpr float kAsideOfFive_px[5][2] = {
    {0.375f, -0.125f}, {-0.375f, 0.125f}, {0, 0}, {-0.125f, -0.375f}, {0.125f, 0.375f}};

}  // namespace

CameraPose camera_pose_of(const BodyPose& pose, const CameraGeometry& geometry) {
  return {pose.position_ned_m + pose.q_ned_body * geometry.position_body_m,
          pose.q_ned_body.toRotationMatrix() * geometry.R_body_cam};
}

Exposure::Exposure(const CameraGeometry& geometry, float exposure_s, bool antialias, const Renderer& renderer)
    : geometry_(geometry), exposure_s_(exposure_s), antialias_(antialias), other_(renderer.frame()) {}

float Exposure::motion_px(const Renderer& renderer, const BodyPose& pose, const CastFrame& frame) const {
  const CameraPose middle = camera_pose_of(pose, geometry_);
  const CameraPose begin = camera_pose_of(moved(pose, -0.5f * exposure_s_), geometry_);
  const CameraPose end = camera_pose_of(moved(pose, 0.5f * exposure_s_), geometry_);
  const Lens& lens = renderer.rays().lens();
  float longest = 0;
  for (int v = 0; v < renderer.height_px(); v += 16)
    for (int u = 0; u < renderer.width_px(); u += 16) {
      if (!renderer.rays().seen(u, v)) continue;
      const float hit = frame.range[static_cast<std::size_t>(v * renderer.width_px() + u)];
      const Vec3 p_ned =
          middle.position_ned_m + (hit > 0.f ? hit : kSky_m) * (middle.R_ned_cam * renderer.rays().direction(u, v));
      vision::Pixel from, to;
      if (vision::pixel_of(lens, begin.R_ned_cam.transpose() * (p_ned - begin.position_ned_m), from) &&
          vision::pixel_of(lens, end.R_ned_cam.transpose() * (p_ned - end.position_ned_m), to))
        longest = std::max(longest, std::hypot(to.u_px - from.u_px, to.v_px - from.v_px));
    }
  return longest;
}

int Exposure::apply(const Renderer& renderer, const BodyPose& pose, CastFrame& frame) {
  const float motion = motion_px(renderer, pose, frame);
  static_assert(kMostCasts == std::size(kAsideOfFive_px));
  if (!(motion > kStill_px)) return 1;
  const int pairs = std::clamp(static_cast<int>(std::ceil(0.5f * (motion / kStep_px - 1))), 1, (kMostCasts - 1) / 2);
  const int casts = 2 * pairs + 1;
  for (int i = -pairs; i <= pairs; ++i) {
    if (i == 0) continue;
    const float after_s = exposure_s_ * static_cast<float>(i) / static_cast<float>(casts);
    const CameraPose camera = camera_pose_of(moved(pose, after_s), geometry_);
    const float* aside = casts == 3 ? kAsideOfThree_px[i + 1] : kAsideOfFive_px[i + 2];
    renderer.cast(camera, other_, antialias_ ? aside[0] : 0.f, antialias_ ? aside[1] : 0.f);
    for (std::size_t at = 0; at < frame.luminance.size(); ++at) frame.luminance[at] += other_.luminance[at];
  }
  const float share = 1.f / static_cast<float>(casts);
  for (float& value : frame.luminance) value *= share;
  return casts;
}

}  // namespace wasp::sim
