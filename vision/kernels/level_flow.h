// A flow field seen in level axes: x along the vehicle's heading, y to its right, z down. What the camera's mount and
// the vehicle's tilt do to the picture is gone, so that "left and right of the heading" means azimuth, whichever lens
// it is. For a wall that stands upright the azimuth's rate does not depend on the height at which one looks at it.
#pragma once

#include <array>
#include <span>

#include "types/camera.h"
#include "types/flow_field.h"
#include "types/realtime.h"

namespace wasp::vision {

/// One cell with a direction. Elevation is up.
struct LevelCell {
  Vec3 first = Vec3::Zero(),
       second = Vec3::Zero();                ///< unit directions before and after the interval; second: if moved
  float azimuth_rad = 0, elevation_rad = 0;  ///< before
  float azimuth_rate_radps = 0;              ///< to the right
  float depth_m = 0;                         ///< distance along `first` [m], 0: unknown
  bool moved = false;                        ///< false: no flow here
};

struct LevelFlow {
  bool valid = false;
  int count = 0;
  float interval_s = 0;
  float yaw_rate_radps = 0;  ///< about the world vertical, clockwise from above, by R_second_first; 0 if unknown
  std::array<LevelCell, FlowField::kMaxColumns * FlowField::kMaxRows> cells{};

  [[nodiscard]] std::span<const LevelCell> view() const WASP_REALTIME {
    return {cells.data(), static_cast<std::size_t>(count)};
  }
};

enum class FlowKind : std::uint8_t { kSeen, kStill };

inline constexpr float kMaxFlowInterval_s = 0.5f;

/// From `earlier` to `later` [s], 0 if it is not later. Any two instants do. Realtime-safe: yes.
constexpr float elapsed_s(TimeNs earlier, TimeNs later) WASP_REALTIME {
  if (later <= earlier) return 0.f;
  return static_cast<float>(
      static_cast<double>(static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier)) * 1e-9);
}

/// Cells with flow or depth (or both). Invalid for a null message, a field of impossible shape, unusable intrinsics, an
/// interval outside (0, kMaxFlowInterval_s], kStill of a field that is not derotated, or an attitude that is not
/// finite. Directions are relative to the heading at the second frame. Realtime-safe: yes.
void level_flow(const CameraGeometry& camera, const FlowMessage* message, FlowKind kind, LevelFlow& out) WASP_REALTIME;

}  // namespace wasp::vision
