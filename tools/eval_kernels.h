// The evaluations `wasp eval` can run: one row a kernel. A new kernel is one function and one row of kEvalKernels.
#pragma once

#include <array>
#include <filesystem>
#include <string_view>
#include <vector>

#include "drivers/recording.h"
#include "tools/eval_figures.h"

namespace wasp::tools {

struct EvalOptions {
  int repeat = 10;    ///< passes over the recording; times and rates are over all of them
  bool cold = false;  ///< forget the previous frame before each one
};

using EvalFunction = std::vector<Figure> (*)(const drivers::Recording&, const EvalOptions&);

/// Floor plane against floor_plane.csv or table_plane.csv, where there is one.
std::vector<Figure> eval_depth_plane(const drivers::Recording& recording, const EvalOptions& options);
/// Height from edges against gt_per_frame.csv, where there is one: up to a scale, lambda being unknown.
std::vector<Figure> eval_edge_height(const drivers::Recording& recording, const EvalOptions& options);
/// Yaw and height ratio a frame of a downward camera against gt_per_frame.csv; without it the camera counts as still.
std::vector<Figure> eval_heading_rate(const drivers::Recording& recording, const EvalOptions& options);
/// Focus of expansion against motion_per_frame.csv (with K.txt) or a ground-truth flow.
std::vector<Figure> eval_foe(const drivers::Recording& recording, const EvalOptions& options);
/// Time to contact against ttc.csv or gt_per_frame.csv; without them every estimate is a false alarm.
std::vector<Figure> eval_time_to_contact(const drivers::Recording& recording, const EvalOptions& options);

/// Flow on the grid beside OpenCV's, against ground-truth flow or, without it, made motions of the folder's images.
std::vector<Figure> eval_flow_grid(const std::filesystem::path& folder, const EvalOptions& options);
/// Depth from flow and the true camera motion, against true depth (a depth image or a board's plane).
std::vector<Figure> eval_flow_depth(const drivers::Recording& recording, const EvalOptions& options);
/// Figures 3.6 and 3.7 from the folder's images, beside cv::phaseCorrelate.
std::vector<Figure> eval_image_shift(const std::filesystem::path& folder, const EvalOptions& options);

struct EvalKernel {
  std::string_view name;
  EvalFunction run;
  std::string_view what;
  /// Instead of `run`, for a kernel that wants any folder of images, not a recording.
  std::vector<Figure> (*run_folder)(const std::filesystem::path&, const EvalOptions&) = nullptr;
};
inline constexpr std::array kEvalKernels = {
    EvalKernel{"image_shift", nullptr, "shift between windows of still images (any folder of PNG)", &eval_image_shift},
    EvalKernel{"depth_plane", &eval_depth_plane, "floor plane from depth images"},
    EvalKernel{"edge_height", &eval_edge_height, "height from the statistics of edges in grey images"},
    EvalKernel{"heading_rate", &eval_heading_rate, "yaw and height ratio of a downward camera"},
    EvalKernel{"foe", &eval_foe, "focus of expansion of a moving camera"},
    EvalKernel{"time_to_contact", &eval_time_to_contact, "frames to contact from growth of the image"},
    EvalKernel{"flow_grid", nullptr, "flow on a grid, beside OpenCV's pyramidal Lucas-Kanade (any folder of PNG)",
               &eval_flow_grid},
    EvalKernel{"flow_depth", &eval_flow_depth, "depth from flow and camera motion"},
};

}  // namespace wasp::tools
