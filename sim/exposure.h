// Motion blur: the shutter is open for a while, the camera moves on, and the image is the mean of what it saw. As many
// whole casts along the way as the motion in the image asks for, so that slow flight costs little; five at most, so
// that beyond 7.5 px of motion the casts lie farther apart than kStep_px. The casts also look a little aside of each
// pixel's centre, each elsewhere: their mean is antialiased without further rays.
#pragma once

#include <array>

#include "sim/pose.h"
#include "sim/renderer.h"

namespace wasp::sim {

/// Where the camera of a body is.
CameraPose camera_pose_of(const BodyPose& pose, const CameraGeometry& geometry);

class Exposure {
 public:
  static constexpr int kMostCasts = 5;
  static constexpr float kStep_px = 1.5f, kStill_px = 0.5f;

  /// For frames of this renderer.
  Exposure(const CameraGeometry& geometry, float exposure_s, bool antialias, const Renderer& renderer);

  /// `frame` is what the camera sees from `pose`, the exposure's middle, already antialiased if that is wanted; its
  /// luminance becomes the mean of the exposure. Allocates nothing. Returns the casts it took, the first one included.
  int apply(const Renderer& renderer, const BodyPose& pose, CastFrame& frame);

  /// Longest way of anything in the image during the exposure [px], judged on every 16th pixel each way.
  [[nodiscard]] float motion_px(const Renderer& renderer, const BodyPose& pose, const CastFrame& frame) const;

 private:
  CameraGeometry geometry_;
  float exposure_s_;
  bool antialias_;
  CastFrame other_;
};

}  // namespace wasp::sim
