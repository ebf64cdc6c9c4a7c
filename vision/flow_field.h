// Behaviours: the optical flow of each camera, made once for all behaviours that need it. They say nothing to control;
// what they make is the FlowMessage of the last two frames: the field as seen, the field without the camera's own turn
// (derotate.h, from the attitudes at the two exposures), and the depth at the cells' centres in the first frame.
#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/depth_median.h"
#include "vision/kernels/flow_grid.h"

namespace wasp::vision {

/// Of both cameras. Sizes and grid take effect when the State is made.
struct FlowFieldParams {
  CameraGeometry camera;
  /// Variance below the thesis' 200 (5.2) still tracks, as the flow's own sigma says, which is the gate that counts: a
  /// wall of natural texture has 10 ... 200 grey^2 up close.
  FlowGridParams grid{.min_variance = 10.f};
  float max_gap_s = 0.2f;    ///< frames farther apart are not compared
  int min_valid_cells = 12;  ///< fewer: the cue is blind (the field is made all the same)
  int min_depth_pixels = 5;  ///< valid ones of the 25 about a cell's centre that make a depth
};

/// The last frame, its attitude and depth, and the message made of it and the one before.
class FlowFieldState {
 public:
  /// Takes all memory. Throws std::invalid_argument for a grid out of range or an image too small for it.
  explicit FlowFieldState(const FlowFieldParams& params);

  /// The field of the last step, nullptr if it made none. Valid until the next step. Realtime-safe: yes.
  [[nodiscard]] const FlowMessage* message() const WASP_REALTIME { return made_ ? &message_ : nullptr; }

  /// Compares with the last frame, and keeps this one. True: there is a message. Realtime-safe: yes.
  bool take(const FlowFieldParams& params, const BehaviourInput& input) WASP_REALTIME;
  [[nodiscard]] int cells_with_depth() const WASP_REALTIME { return cells_with_depth_; }

 private:
  using Depths = std::array<std::uint16_t, static_cast<std::size_t>(FlowField::kMaxColumns* FlowField::kMaxRows)>;
  [[nodiscard]] GrayView last() const WASP_REALTIME;
  [[nodiscard]] bool follows(const FlowFieldParams& params, TimeNs now_ns) const WASP_REALTIME;
  void compare(const FlowFieldParams& params, const BehaviourInput& input) WASP_REALTIME;
  void keep(const FlowFieldParams& params, const BehaviourInput& input) WASP_REALTIME;

  FlowGrid grid_;
  int width_px_, height_px_, cells_;
  std::vector<std::uint8_t> pixels_;  ///< the last frame, packed
  std::array<DepthPixel, static_cast<std::size_t>(FlowField::kMaxColumns* FlowField::kMaxRows)> centres_{};
  Depths depth_mm_{};  ///< of the last frame, at the centres; 0: unknown
  bool has_last_ = false, has_attitude_ = false, made_ = false;
  TimeNs last_at_ns_ = 0;
  std::array<float, 4> last_q_ned_body_{1, 0, 0, 0};
  int cells_with_depth_ = 0;
  FlowMessage message_;
};

/// What both say in CueBody::detail.
struct FlowFieldDetail {
  /// Index into CueBody::detail.
  enum Detail {
    kValidCells,
    kMedianSeen_px,   ///< median length of the flow over the valid cells, as seen
    kMedianStill_px,  ///< and without the camera's turn
    kInterval_s,
    kDerotated,  ///< 1 or 0
    kTurn_rad,   ///< angle of the camera's turn between the frames
    kCellsWithDepth,
    kResidual  ///< mean over the valid cells [grey levels]
  };
};

/// The step of both. Realtime-safe: yes.
CueBody flow_field_step(const FlowFieldParams& params, const BehaviourInput& input,
                        FlowFieldState& state) WASP_REALTIME;

template <Stream kFrom, Stream kTo>
struct FlowFieldOf : FlowFieldDetail {
  static constexpr std::string_view kName = kTo == Stream::kFlow ? "flow_field" : "flow_field_down";
  static constexpr DurationNs kBudgetNs = 5 * kMillisecond;
  static constexpr Stream kStream = kFrom;
  static constexpr Stream kPublishes = kTo;

  using Params = FlowFieldParams;
  using State = FlowFieldState;

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("columns", p.grid.columns, 4, FlowField::kMaxColumns);
    visit("rows", p.grid.rows, 3, FlowField::kMaxRows);
    visit("min_variance", p.grid.min_variance, 0.0, 5000.0);
    visit("max_flow_sigma_px", p.grid.max_flow_sigma_px, 0.01, 5.0);
    visit("max_backward_px", p.grid.max_backward_px, 0.0, 10.0);
    visit("max_gap_s", p.max_gap_s, 0.01, 1.0);
    visit("min_valid_cells", p.min_valid_cells, 1, FlowField::kMaxColumns * FlowField::kMaxRows);
    visit("min_depth_pixels", p.min_depth_pixels, 1, 25);
  }

  static const FlowMessage* flow(const State& state) WASP_REALTIME { return state.message(); }

  /// Valid when a field was made and has enough valid cells; quality is their share. Blind for the first frame, after a
  /// gap, for time that does not increase (the new frame is kept all the same) and for an image of another size, which
  /// is not. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME {
    return flow_field_step(params, input, state);
  }
};

/// Of the front camera, with depth where there is some.
using FlowFieldFront = FlowFieldOf<Stream::kGrayDepth, Stream::kFlow>;
/// Of the camera that looks down.
using FlowFieldDown = FlowFieldOf<Stream::kDown, Stream::kFlowDown>;

static_assert(FlowSource<FlowFieldFront> && FlowSource<FlowFieldDown>);

}  // namespace wasp::vision
