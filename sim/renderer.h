// Ray-traced images of a world: coherent casts (Embree, packets of 4 x 4 pixels) yield intensity, true depth and which
// face each pixel sees. Faces are flat, so an edge of the geometry is exactly where neighbouring pixels see different
// faces: there, if asked, a pixel becomes the mean of four rays on a rotated grid. Depth stays that of the centre ray.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "sim/camera_rays.h"
#include "sim/world_scene.h"
#include "types/camera.h"

namespace wasp::sim {

/// Where the camera is and how it looks.
struct CameraPose {
  Vec3 position_ned_m = Vec3::Zero();
  Mat3 R_ned_cam = Mat3::Identity();
};

/// One image as cast, row-major, height_px x width_px.
struct CastFrame {
  explicit CastFrame(std::size_t pixels = 0) : luminance(pixels), range(pixels), face(pixels) {}
  std::vector<float> luminance;     ///< pixel values, 0 ... about 255, not clamped
  std::vector<float> range;         ///< ray parameter: a pinhole's depth, a fisheye's distance [m]; 0: nothing hit
  std::vector<std::uint32_t> face;  ///< which face; kNoFace: none, kUnseen: beyond the lens' field
  static constexpr std::uint32_t kNoFace = ~0u, kUnseen = ~0u - 1;
};

class Renderer {
 public:
  static constexpr int kBandRows = 4;

  /// Throws std::runtime_error when the sizes are not multiples of 4, the lens is unusable, or Embree fails.
  Renderer(std::shared_ptr<const WorldScene> scene, const Lens& lens, float field_of_view_rad);
  /// A pinhole in a world of its own.
  Renderer(World world, const Intrinsics& intrinsics);

  /// A frame of this renderer's size.
  [[nodiscard]] CastFrame frame() const;
  /// One ray for each pixel, this far to the right of and below its centre. Allocates nothing, as nothing below.
  void cast(const CameraPose& pose, CastFrame& frame, float right_px = 0, float down_px = 0) const;
  /// Smooths the edges of a frame just cast from `pose`. One thread at a time.
  void antialias(const CameraPose& pose, CastFrame& frame);
  /// Rows [first_row, first_row + kBandRows) of a cast: luminance and optical-axis depth (0 where nothing is hit and,
  /// with a fisheye, at right angles to the axis and behind); both row-major, kBandRows x width. first_row is a
  /// multiple of kBandRows.
  void render_band(const CameraPose& pose, int first_row, float* luminance, float* depth_m) const;
  /// Optical-axis depth of row v from its ray parameters; `range` and `depth_m` may be the same.
  void depth_row(int v, const float* range, float* depth_m) const;

  [[nodiscard]] int width_px() const { return rays_.width_px(); }
  [[nodiscard]] int height_px() const { return rays_.height_px(); }
  /// Where parts of the world move, hold its `at` while casting.
  [[nodiscard]] const WorldScene& scene() const { return *scene_; }
  [[nodiscard]] const CameraRays& rays() const { return rays_; }
  /// Pixels with an edge in the frame last smoothed.
  [[nodiscard]] std::size_t edge_pixels() const { return edges_.size(); }

 private:
  struct Band {
    float *luminance, *range;
    std::uint32_t* face;  ///< nullptr: not wanted
  };
  void cast_band(const CameraPose& pose, int first_row, float right_px, float down_px, const Band& to) const;
  void find_edges(const CastFrame& frame);
  float aim(RayPacket& rays, std::uint32_t at, std::size_t k, bool used) const;

  std::shared_ptr<const WorldScene> scene_;
  CameraRays rays_;
  std::vector<float> axis_;          ///< CameraRays::axis of each pixel; empty for a pinhole
  std::vector<std::uint8_t> marks_;  ///< a row of scratch: 1 where a pixel has an edge
  std::vector<std::uint32_t> edges_;
};

}  // namespace wasp::sim
