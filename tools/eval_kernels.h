// The evaluations `wasp eval` can run: one row a kernel. A new kernel is one function and one row of kEvalKernels.
#pragma once

#include <array>
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

struct EvalKernel {
  std::string_view name;
  EvalFunction run;
  std::string_view what;
};
inline constexpr std::array kEvalKernels = {
    EvalKernel{"depth_plane", &eval_depth_plane, "floor plane from depth images"},
    EvalKernel{"edge_height", &eval_edge_height, "height from the statistics of edges in grey images"},
};

}  // namespace wasp::tools
