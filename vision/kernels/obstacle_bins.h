// Distances around the vehicle in 72 directions, as MAVLink's OBSTACLE_DISTANCE wants them, from the depths of one flow
// field: level axes, so that a tilt moves nothing; what counts is what stands in the band of heights the vehicle flies
// in. A direction nobody looked into is unknown, and so is one whose rays leave the band, or meet no depth, before the
// greatest distance: "nothing there" is said only of what was looked through.
#pragma once

#include <array>
#include <cstdint>

#include "types/camera.h"
#include "types/flow_field.h"
#include "types/realtime.h"
#include "vision/kernels/obstacle_map.h"

namespace wasp::vision {

inline constexpr int kObstacleBins = 72;
inline constexpr std::uint16_t kBinUnknown = 65535;

struct ObstacleBinsParams {
  CameraGeometry camera;
  MapParams map;                           ///< the band of heights
  float least_m = 0.3f, greatest_m = 4.f;  ///< what the depths can tell; up to 600
};

struct ObstacleBins {
  bool valid = false;
  /// [cm], clockwise from the heading, 5 degrees each, bin 0 about the heading itself; kBinUnknown; greatest + 1:
  /// nothing there.
  std::array<std::uint16_t, kObstacleBins> distance_cm{};
  TimeNs exposed_at_ns = 0;  ///< of the depths
  int seen = 0;              ///< bins that are known
};

/// Invalid for a message that is none, or without any depth. Realtime-safe: yes.
ObstacleBins obstacle_bins(const ObstacleBinsParams& params, const FlowMessage& message) WASP_REALTIME;

}  // namespace wasp::vision
