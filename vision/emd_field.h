// Behaviour: a flow field as an insect might make it, by an array of motion detectors (thesis 2.1.3.2,
// vision/kernels/emd_grid.h), in the form that flow_field publishes, so that what steers by flow can be flown with
// either. A detector's answer over its contrast grows with speed only up to a temporal frequency of 1/(2 pi delay), and
// with the square of the pattern's spatial frequency; `px_per_response` turns it into pixels a frame for slow motion of
// natural texture (measured: 4 to 10 at 2 px/frame, for grain from 16 to 64 px; rising up to 6 px/frame) and no more.
// Directions and the balance of left and right do not depend on it.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/emd_grid.h"

namespace wasp::vision {

struct EmdFlow {
  static constexpr std::string_view kName = "emd_field";
  static constexpr DurationNs kBudgetNs = 3 * kMillisecond;
  static constexpr Stream kStream = Stream::kGray;
  static constexpr Stream kPublishes = Stream::kFlow;

  /// Index into CueBody::detail: valid cells, mean response over contrast of the left and of the right half of them
  /// (away from the image's middle: positive), mean contrast [grey^2], interval between the frames, 1 if derotated.
  enum Detail { kValidCells, kLeft, kRight, kContrast, kInterval_s, kDerotated };

  struct Params {
    CameraGeometry camera;
    EmdParams grid{.columns = 12, .rows = 9, .pitch_px = 8, .delay_frames = 1.f, .mean_frames = 20.f};
    float px_per_response = 6.f;  ///< motion [px/frame] for response / contrast = 1
    float min_contrast = 20.f;    ///< [grey^2]: below it a cell is not valid
    float good_contrast = 200.f;  ///< [grey^2]: from here on its quality is 1
    float max_gap_s = 0.2f;       ///< detectors start anew after a longer gap
    int min_valid_cells = 6;      ///< fewer: the cue is blind (the field is made all the same)
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("columns", p.grid.columns, 2, FlowField::kMaxColumns);
    visit("rows", p.grid.rows, 2, FlowField::kMaxRows);
    visit("pitch_px", p.grid.pitch_px, 2, 64);
    visit("delay_frames", p.grid.delay_frames, 0.1, 50.0);
    visit("mean_frames", p.grid.mean_frames, 0.2, 500.0);
    visit("px_per_response", p.px_per_response, 0.01, 1000.0);
    visit("min_contrast", p.min_contrast, 0.01, 10000.0);
    visit("good_contrast", p.good_contrast, 0.01, 10000.0);
    visit("max_gap_s", p.max_gap_s, 0.01, 1.0);
    visit("min_valid_cells", p.min_valid_cells, 1, FlowField::kMaxColumns * FlowField::kMaxRows);
  }

  struct State {
    /// Takes all memory. Throws std::invalid_argument for a grid out of range or an image too small for it.
    explicit State(const Params& params);
    EmdGrid grid;
    EmdField response;
    FlowMessage message;
    bool made = false, has_attitude = false;
    TimeNs last_at_ns = kNever;
    std::array<float, 4> last_q_ned_body{1, 0, 0, 0};
  };

  /// The field of the last step, nullptr if it made none. Realtime-safe: yes.
  static const FlowMessage* flow(const State& state) WASP_REALTIME { return state.made ? &state.message : nullptr; }

  /// Valid when a field was made and has enough valid cells; quality is their share. Blind for the first frame, after a
  /// gap, for time that does not increase and for an image of the wrong size. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(FlowSource<EmdFlow>);

}  // namespace wasp::vision
