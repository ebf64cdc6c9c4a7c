// Behaviour: height from edge statistics (thesis section 7.2; vision/kernels/edge_height.h). Attitude moves the
// horizon; without it the camera is taken as level on its mount and the spread is widened.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/edge_height.h"
#include "vision/kernels/edge_rows.h"

namespace wasp::vision {

struct EdgeAltitude {
  static constexpr std::string_view kName = "edge_altitude";
  static constexpr DurationNs kBudgetNs = 3 * kMillisecond;
  static constexpr Stream kStream = Stream::kGray;

  /// Index into CueBody::detail.
  enum Detail { kModeHeight_m, kEdgesPerHeight, kMisfit, kEdgeShare, kThreshold, kFirstRow_px, kModel, kRawHeight_m };

  struct Params {
    CameraGeometry camera;
    EdgeHeightParams height;
    int min_threshold = 8;     ///< Sobel units, see EdgeRowsParams
    float max_misfit = 0.25f;  ///< distribution model: a larger gap is no Poisson floor
    float smoothing_s = 0.3f;  ///< time constant of the low pass; 0: none
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("edges_per_m", p.height.edges_per_m, 0.01, 1000.0);
    visit("resolution_px", p.height.resolution_px, 0.5, 20.0);
    visit("edge_thickness_px", p.height.edge_thickness_px, 1.0, 20.0);
    visit("min_threshold", p.min_threshold, 0, 1020);
    visit("max_misfit", p.max_misfit, 0.01, 1.0);
    visit("smoothing_s", p.smoothing_s, 0.0, 10.0);
  }

  /// The filter's memory: what it last said and when.
  struct State {
    TimeNs filtered_at_ns = kNever;
    float filtered_height_m = 0;
  };

  /// height_m: camera centre above the floor, low-passed. quality: 1 - misfit / max_misfit (count model: 0.5).
  /// detail: (7.36)'s height, mu, misfit, edge share, threshold, first floor row, model (1 distribution, 2 count) and
  /// the height of this frame alone. A frame older than the last one, or a gap above 1 s, restarts the filter.
  /// Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<EdgeAltitude>);

}  // namespace wasp::vision
