// A fixed budget of depth samples: one pixel in each cell of a 40 x 30 grid, jittered by a hash of the cell so that no
// pattern of the scene or the sensor lines up with the grid. Each sample is a ray and an inverse depth, the space in
// which a plane is affine and the noise of a disparity sensor is uniform.
#pragma once

#include <array>
#include <cstdint>

#include "types/camera.h"
#include "types/image_view.h"
#include "types/realtime.h"

namespace wasp::vision {

inline constexpr int kSampleColumns = 40, kSampleRows = 30;
inline constexpr int kSampleCount = kSampleColumns * kSampleRows;
inline constexpr int kMinImageSide = 16;  ///< smaller images are refused

/// Where the samples are, for one camera: worked out on the first frame and again only when the camera changes.
struct SampleTable {
  Intrinsics intrinsics{.width_px = 0, .height_px = 0};  ///< key
  std::array<std::uint16_t, kSampleCount> u_px{}, v_px{};
  std::array<float, kSampleCount> x{}, y{};        ///< undistorted ray
  std::array<std::uint16_t, kSampleCount> seen{};  ///< all bits set, or 0: the lens model has no ray here
};

/// The valid samples of one frame, packed, in row-major cell order.
struct DepthSamples {
  int count = 0;
  static constexpr std::size_t kRoom = kSampleCount + 16;  ///< a vector beyond the last sample may be written
  alignas(64) std::array<float, kRoom> x, y;               ///< ray [-]
  alignas(64) std::array<float, kRoom> w;                  ///< inverse depth [1/m]
  alignas(64) std::array<std::int32_t, kRoom> cell;        ///< sample index to cell
  std::array<std::int16_t, kSampleCount> of_cell;          ///< cell to sample index, -1 where invalid
};

/// Range of depth that counts [m].
struct DepthRange {
  float min_m = 0.3f, max_m = 8.f;
};

/// Rebuilds `table` if it is not for these intrinsics. False when they are unusable. Realtime-safe: yes (bounded).
bool prepare(SampleTable& table, const Intrinsics& k) WASP_REALTIME;

/// Gathers the samples of `depth` (uint16 millimetres; 0 and 65535 are invalid) into `out`.
/// Needs an image of the table's size. Realtime-safe: yes.
void gather(const SampleTable& table, const DepthView& depth, const DepthRange& range, DepthSamples& out) WASP_REALTIME;

}  // namespace wasp::vision
