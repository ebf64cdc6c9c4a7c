// Optical flow on a grid, the default engine: a block of 12 tiles (32 x 32 px without its corners) about each cell's
// centre is followed by inverse compositional Gauss-Newton from the top of a small pyramid to the full image, with
// translation and affine terms (zoom, rotation, shear) and robust weights by tile. Coarse levels have coarse grids; a
// cell starts from the nearest cell above, extrapolated, or from one of its neighbours, whichever
// fits the cell's very centre best: near an edge of depth the block's larger part may belong to the other surface. All
// loops are bounded.
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
  int columns = 12, rows = 9;       ///< 1 ... FlowField::kMaxColumns, 1 ... FlowField::kMaxRows
  int levels = 5;                   ///< of the pyramid, 1 ... FlowPyramid::kMaxLevels
  float min_variance = 200.f;       ///< grey^2 over the block: below it a cell gets no flow (section 5.2)
  float noise_gray = 2.f;           ///< one sigma of the difference of two aligned pixels
  float slack_px = 0.1f;            ///< misalignment inside a block that is not held against a tile
  float affine_sigma = 0.03f;       ///< prior of the affine terms [px/px]
  float shift_sigma_px = 1.f;       ///< prior of the correction one level makes to the one above [px of that level]
  int max_steps = 3;                ///< Gauss-Newton steps a level, 1 ... 16; twice as many at coarse levels
  float converged_px = 0.15f;       ///< a smaller step ends a level early
  float max_flow_sigma_px = 0.25f;  ///< a cell whose flow is less certain is not valid
  float max_backward_px = 0.f;      ///< > 0: forward-backward check against this distance; doubles the time
};

/// What the last call did. Largest possible: see FlowGrid::worst_case().
struct FlowGridTrips {
  int blocks = 0;   ///< blocks cut (cell times level)
  int passes = 0;   ///< blocks compared with the second image and moved by a Gauss-Newton step
  int guesses = 0;  ///< first guesses tried at a cell's centre
};

class FlowGrid {
 public:
  /// Takes all memory. Throws std::invalid_argument for parameters out of range or an image too small for one block.
  FlowGrid(int width_px, int height_px, const FlowGridParams& params);

  /// Motion from `first` to `second`, mono8 of the constructor's size. All cells invalid for bad views.
  /// Realtime-safe: yes.
  void track(const GrayView& first, const GrayView& second, FlowField& out) WASP_REALTIME;

  /// The same for a stream, one pyramid cheaper: `first` must show the very pixels that were `second` in the last call;
  /// its pyramid is kept from then. Like track() where there is none. Realtime-safe: yes.
  void follow(const GrayView& first, const GrayView& second, FlowField& out) WASP_REALTIME;

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
  static constexpr int kMaxGuesses = 9;
  [[nodiscard]] FlowPyramid& first() WASP_REALTIME { return pyramids_[first_]; }
  [[nodiscard]] FlowPyramid& second() WASP_REALTIME { return pyramids_[1 - first_]; }
  struct Level;
  struct Fit;
  class Guesses;

  [[nodiscard]] Level level_of(int level) const WASP_REALTIME;
  void clear(FlowField& out) const WASP_REALTIME;
  void solve(bool built, const GrayView& second, FlowField& out) WASP_REALTIME;
  void run(const FlowPyramid& from, const FlowPyramid& to, Motions& motions, FlowField& out) WASP_REALTIME;
  CellMotion start(const Level& above, const GrayView& first, const GrayView& second,
                   const BlockSite& site) WASP_REALTIME;
  void cut(const GrayView& first, Fit& fit) WASP_REALTIME;
  void refine(const GrayView& second, int max_steps, CellMotion& motion, Fit& fit) WASP_REALTIME;
  bool step(CellMotion& motion, const CellMotion& prior, Fit& fit) WASP_REALTIME;
  [[nodiscard]] float shift_sigma_px(const BlockSums& sums, const BlockMatch& match) const WASP_REALTIME;
  void judge(const Fit& fit, const CellMotion& motion, FlowCell& cell) const WASP_REALTIME;
  void check_backward(FlowField& out) WASP_REALTIME;

  FlowGridParams params_;
  std::array<FlowPyramid, 2> pyramids_;
  std::size_t first_ = 0;  ///< which of them is the first image's
  bool kept_ = false;      ///< the other holds the last call's second image
  Motions motions_{}, backward_{};
  Motions above_{};  ///< of the level above, shifts in pixels of this one
  FlowField backward_field_;
  FlowGridTrips trips_;
};

}  // namespace wasp::vision
