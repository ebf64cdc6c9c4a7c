// Optical flow on a grid, the default engine: a block of 4 x 4 tiles (32 x 32 px) about each cell's centre is followed
// by inverse compositional Gauss-Newton from the top of a small pyramid to the full image, with translation and affine
// terms (zoom, rotation, shear) and robust weights by tile. Coarse levels have coarse grids; a cell starts from the
// better of the nearest cell above, extrapolated, and the median of the cells around it. All loops are bounded.
//
// Sources: Baker and Matthews, "Lucas-Kanade 20 years on" (IJCV 2004) for the inverse compositional form; thesis
// sections 3.2.1 and 5.2 for the grid and the variance gate.
#pragma once

#include <array>
#include <cstdint>

#include "types/image_view.h"
#include "types/realtime.h"
#include "vision/kernels/flow_field.h"
#include "vision/kernels/flow_grid_tiles.h"
#include "vision/kernels/flow_pyramid.h"

namespace wasp::vision {

struct FlowGridParams {
  int columns = 12, rows = 9;     ///< 1 ... FlowField::kMaxColumns, 1 ... FlowField::kMaxRows
  int levels = 5;                 ///< of the pyramid, 1 ... FlowPyramid::kMaxLevels
  float min_variance = 200.f;     ///< grey^2 over the block: below it a cell gets no flow (section 5.2)
  float noise_gray = 3.f;         ///< one sigma of the difference of two aligned pixels
  float slack_px = 0.2f;          ///< misalignment inside a block that is not held against a tile
  float affine_sigma = 0.05f;     ///< prior of the affine terms [px/px]
  float shift_sigma_px = 2.f;     ///< prior of the correction one level makes to the one above [px of that level]
  int max_steps = 3;              ///< Gauss-Newton steps a level, 1 ... 16; twice as many at coarse levels
  float converged_px = 0.05f;     ///< a smaller step ends a level early
  float max_flow_sigma_px = 1.f;  ///< a cell whose flow is less certain is not valid
  float max_backward_px = 0.f;    ///< > 0: forward-backward check against this distance; doubles the time
};

/// What the last call did. Largest possible: see FlowGrid::worst_case().
struct FlowGridTrips {
  int blocks = 0;  ///< blocks cut (cell times level)
  int passes = 0;  ///< blocks compared with the second image
  int steps = 0;   ///< 6 x 6 systems solved
};

class FlowGrid {
 public:
  /// Takes all memory. Throws std::invalid_argument for parameters out of range or an image too small for one block.
  FlowGrid(int width_px, int height_px, const FlowGridParams& params);

  /// Motion from `first` to `second`, mono8 of the constructor's size. All cells invalid for bad views.
  /// Realtime-safe: yes.
  void track(const GrayView& first, const GrayView& second, FlowField& out) WASP_REALTIME;

  /// Affine motion of a cell (row * columns + column) in the last call, in full-image pixels.
  [[nodiscard]] const CellMotion& motion(int cell) const WASP_REALTIME {
    return motions_[static_cast<std::size_t>(cell)];
  }
  [[nodiscard]] const FlowGridTrips& trips() const WASP_REALTIME { return trips_; }
  /// Bound of trips(), from sizes and parameters alone.
  [[nodiscard]] FlowGridTrips worst_case() const WASP_REALTIME;

 private:
  static constexpr int kMaxCells = FlowField::kMaxColumns * FlowField::kMaxRows;
  using Motions = std::array<CellMotion, static_cast<std::size_t>(kMaxCells)>;
  struct Level;
  struct Fit;

  [[nodiscard]] Level level_of(int level) const WASP_REALTIME;
  void clear(FlowField& out) const WASP_REALTIME;
  void run(const FlowPyramid& from, const FlowPyramid& to, Motions& motions, FlowField& out) WASP_REALTIME;
  CellMotion start(const Level& above, const Motions& motions_above, const GrayView& second, Fit& fit) WASP_REALTIME;
  void cut(const GrayView& first, Fit& fit) WASP_REALTIME;
  float compare(const GrayView& second, const CellMotion& motion, Fit& fit) WASP_REALTIME;
  void refine(const GrayView& second, int max_steps, CellMotion& motion, Fit& fit) WASP_REALTIME;
  bool step(CellMotion& motion, const CellMotion& prior, Fit& fit) WASP_REALTIME;
  [[nodiscard]] float shift_sigma_px(const BlockSums& sums) const WASP_REALTIME;
  void judge(const Fit& fit, const CellMotion& motion, FlowCell& cell) const WASP_REALTIME;
  void check_backward(FlowField& out) WASP_REALTIME;

  FlowGridParams params_;
  FlowPyramid first_, second_;
  Motions motions_{}, backward_{}, above_{};
  FlowField backward_field_;
  FlowGridTrips trips_;
};

}  // namespace wasp::vision
