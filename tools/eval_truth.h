// Reference values beside a recording: floor_plane.csv / table_plane.csv (a plane a frame) and gt_per_frame.csv
// (height a frame). A folder without such a table has no truth, which is not an error; a damaged table is.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "types/frames.h"

namespace wasp::tools {

/// Plane in camera axes: n . X + height = 0, n towards the camera.
struct PlaneTruth {
  Vec3 normal_cam = Vec3::Zero();
  float height_m = 0;
};

/// Planes by frame key ("60", "laptop_floor_0"): the frame's own fit where the table has one. Throws
/// std::runtime_error with file and line for a damaged table.
std::map<std::string, PlaneTruth> read_plane_truth(const std::filesystem::path& folder);

/// Height along the optical axis [m] by frame number, from gt_per_frame.csv.
std::map<std::string, float> read_height_truth(const std::filesystem::path& folder);

/// The key of a frame file in those tables: "frame-000060.depth.png" -> "60", "depth_1.pgm" -> "1",
/// "learn0_depth.png" -> "learn0", "test0620.png" -> "620".
std::string frame_key(const std::filesystem::path& file);

}  // namespace wasp::tools
