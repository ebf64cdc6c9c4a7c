// What stands around the vehicle at the height it flies at: a polar histogram over the full circle, each sector with
// the nearest thing known in it, in level axes (x along the heading, y right). It moves along with the vehicle, so that
// what has left the view to the side, or come too near for the depth camera, is remembered for a while; what the camera
// now looks through is forgotten.
#pragma once

#include <array>
#include <span>

#include "types/realtime.h"
#include "vision/kernels/level_flow.h"

namespace wasp::vision {

inline constexpr int kSectors = 72;  ///< of 5 degrees; sector 0 begins straight behind, going left to right

inline constexpr int kMaxReadings = FlowField::kMaxColumns * FlowField::kMaxRows;

struct MapPoint {
  float x_m = 0, y_m = 0;        ///< ahead and to the right
  float vx_mps = 0, vy_mps = 0;  ///< its own motion over ground, in the same axes
  float unseen_s = 0;
  bool known = false;
};

struct ObstacleMap {
  std::array<MapPoint, kSectors> sector{};
};

struct MapParams {
  float above_m = 0.4f, below_m = 0.4f;  ///< of the camera: the band of heights in which things are in the way
  float max_range_m = 5.f;
  float memory_s = 2.5f;           ///< a thing not seen for so long is forgotten
  float least_motion_mps = 0.25f;  ///< own motion towards the vehicle below this counts as none
  float greatest_motion_mps = 1.2f;
};

/// One cell's range reading.
struct MapReading {
  float azimuth_rad = 0, x_m = 0, y_m = 0, range_m = 0;  ///< range: horizontal
  float closing_mps = 0, closing_weight = 0;             ///< speed towards the vehicle along the heading, if weight > 0
  float through_m = 0;   ///< horizontal range up to which the cell's ray runs within the band and meets nothing
  bool in_band = false;  ///< false: the cell sees something above or below the way, or far off
};

/// How the vehicle moved since the last field: along its old heading, to its right, and clockwise.
struct VehicleStep {
  float dt_s = 0, forward_m = 0, right_m = 0, turn_rad = 0;
};

int sector_of(float azimuth_rad) WASP_REALTIME;

/// Readings of the cells whose `range` (metres along the cell's direction, 0: unknown; index as in `flow`) is known.
/// Returns how many were written. Realtime-safe: yes.
int map_readings(const MapParams& params, const LevelFlow& flow, std::span<const float> range_m,
                 std::span<MapReading> out) WASP_REALTIME;

/// Carries the map along. A step that is not finite empties it. Realtime-safe: yes.
void advance(const MapParams& params, const VehicleStep& step, ObstacleMap& map) WASP_REALTIME;

/// Takes out of the band whatever reading has no other near it in direction (`spacing_rad`) and range: a wrong match or
/// a flying pixel. Readings of one thing stand together: it fills several rows. Realtime-safe: yes.
void drop_lone(float spacing_rad, std::span<MapReading> readings) WASP_REALTIME;

/// Enters the readings, each `spacing_rad` apart; `speed_mps` is the vehicle's own. Realtime-safe: yes.
void observe(const MapParams& params, std::span<const MapReading> readings, float spacing_rad, float speed_mps,
             ObstacleMap& map) WASP_REALTIME;

}  // namespace wasp::vision
