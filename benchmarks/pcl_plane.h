// What a user of PCL would do to find a plane: RANSAC through SACSegmentation. Built only where PCL is installed.
#pragma once

#include <functional>
#include <string>

#include "benchmarks/vision_data.h"

namespace wasp::bench {

/// Calls of SACSegmentation on the valid points of every depth frame, every `step`-th row and column; the clouds are
/// made here, so that a call times the segmentation alone (20 mm, coefficients optimised, PCL's default iterations).
std::function<void(int)> pcl_plane(const VisionData& data, int step);
std::string pcl_version();

}  // namespace wasp::bench
