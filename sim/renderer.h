// Ray-traced images of a world: one coherent cast (Embree, packets of 4 x 4 pixels) yields intensity and true depth.
// A ray's direction has unit length along the optical axis, so its hit parameter is the optical-axis depth itself.
// Shading: the surface's brightness times its texture at the right mipmap level.
#pragma once

#include <memory>
#include <vector>

#include "sim/world_scene.h"
#include "types/camera.h"

namespace wasp::sim {

/// Where the camera is and how it looks.
struct CameraPose {
  Vec3 position_ned_m = Vec3::Zero();
  Mat3 R_ned_cam = Mat3::Identity();
};

class Renderer {
 public:
  static constexpr int kBandRows = 4;

  /// Builds the acceleration structure; keeps the world. Image width and height must be multiples of 4.
  /// Throws std::runtime_error when they are not or Embree fails. Distortion is inverted once, for every pixel.
  Renderer(World world, const Intrinsics& intrinsics);
  /// The same into a world that other cameras see too.
  Renderer(std::shared_ptr<const WorldScene> scene, const Intrinsics& intrinsics);

  /// Rows [first_row, first_row + kBandRows): `luminance` in pixel values (0 ... about 255, not clamped), `depth_m`
  /// along the optical axis (0 where nothing is hit); both row-major, kBandRows x width. first_row is a multiple of
  /// kBandRows.
  void render_band(const CameraPose& pose, int first_row, float* luminance, float* depth_m) const;

  [[nodiscard]] int width_px() const { return intrinsics_.width_px; }
  [[nodiscard]] int height_px() const { return intrinsics_.height_px; }
  [[nodiscard]] const Intrinsics& intrinsics() const { return intrinsics_; }

 private:
  struct Packet {
    float x[16], y[16];  ///< normalised image coordinates of 4 x 4 pixels
  };
  void build_rays();

  std::shared_ptr<const WorldScene> scene_;
  Intrinsics intrinsics_;
  std::vector<Packet> packets_;  ///< by block row, then block column
};

}  // namespace wasp::sim
