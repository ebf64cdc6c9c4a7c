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
  alignas(64) std::array<float, kSampleCount> x{}, y{};  ///< undistorted ray
  std::array<std::uint16_t, kSampleCount> seen{};        ///< all bits set, or 0: the lens model has no ray here
};

/// Inverse depth of a cell whose pixel has none [1/m]: far above any plane, so that no count or sum takes it up.
inline constexpr float kAbsent_per_m = 1e6f;

/// One frame's samples. They stay in their cells, beside the table's rays: packing the valid ones costs more time than
/// the passes lose on the others, and the time of a pass does not depend on how many there are.
struct DepthSamples {
  alignas(64) std::array<float, kSampleCount> w;  ///< inverse depth of each cell [1/m], or kAbsent_per_m
  std::array<std::int16_t, kSampleCount> valid;   ///< the cells that have one, rising
  int count = 0;                                  ///< of them
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
