// The viewing direction of every pixel, worked out once for a lens, in packets of 4 x 4 pixels as they are cast.
//
// A pinhole's direction has unit length along the optical axis, so that a ray's parameter is the depth along that axis;
// a fisheye also sees at right angles to its axis and beyond, so its directions are unit vectors and the parameter is
// the distance. `axis` turns either into depth.
#pragma once

#include <cstdint>
#include <vector>

#include "types/camera.h"

namespace wasp::sim {

struct RayPacket {
  alignas(64) float x[16], y[16], z[16];  ///< directions, camera axes; (0, 0, 1) where the lens sees nothing
  alignas(64) std::int32_t seen[16];      ///< -1, or 0 beyond the lens' field
  Vec3 du, dv;                            ///< change of direction for one pixel to the right and down, mid-packet
  float pixel;                            ///< a pixel's width at ray parameter 1 [m]
};

class CameraRays {
 public:
  /// `field_of_view_rad` is the full angle of the image circle. Throws std::runtime_error when the image's sizes are
  /// not positive multiples of 4 or a focal length is not positive.
  CameraRays(const Lens& lens, float field_of_view_rad);

  [[nodiscard]] const Lens& lens() const { return lens_; }
  [[nodiscard]] int width_px() const { return lens_.intrinsics.width_px; }
  [[nodiscard]] int height_px() const { return lens_.intrinsics.height_px; }
  /// Packets by block row, then block column.
  [[nodiscard]] const RayPacket& packet(int block_row, int block_column) const {
    return packets_[static_cast<std::size_t>(block_row * (width_px() / 4) + block_column)];
  }
  [[nodiscard]] bool seen(int u, int v) const { return packet(v / 4, u / 4).seen[v % 4 * 4 + u % 4] != 0; }
  [[nodiscard]] Vec3 direction(int u, int v) const;
  /// Depth along the optical axis for a ray parameter of 1; 0 behind the lens and where nothing is seen.
  [[nodiscard]] float axis(int u, int v) const;

 private:
  void aim(int u, int v, float field_of_view_rad);
  void measure(RayPacket& packet, int u, int v) const;
  [[nodiscard]] Vec3 slope(int u, int v, int step_u, int step_v) const;

  Lens lens_;
  std::vector<RayPacket> packets_;
};

}  // namespace wasp::sim
