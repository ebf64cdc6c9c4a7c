// Every kernel `wasp bench vision` knows: one function a file benchmarks/vision_<kernel>.cpp, one row here.
#pragma once

#include <vector>

#include "benchmarks/vision_bench.h"

namespace wasp::bench {

std::vector<VisionRow> edge_rows_rows(const VisionData& data);
std::vector<VisionRow> flow_grid_rows(const VisionData& data);
std::vector<VisionRow> depth_median_rows(const VisionData& data);
std::vector<VisionRow> depth_plane_rows(const VisionData& data);
std::vector<VisionRow> cluster_rows(const VisionData& data);
std::vector<VisionRow> image_shift_rows(const VisionData& data);
std::vector<VisionRow> log_polar_rows(const VisionData& data);
std::vector<VisionRow> motion_rows(const VisionData& data);
std::vector<VisionRow> frame_rows(const VisionData& data);

using VisionRowMaker = std::vector<VisionRow> (*)(const VisionData&);
inline constexpr VisionRowMaker kVisionRowMakers[] = {
    &log_polar_rows,   &edge_rows_rows, &flow_grid_rows, &image_shift_rows, &depth_median_rows,
    &depth_plane_rows, &cluster_rows,   &motion_rows,    &frame_rows,
};

}  // namespace wasp::bench
