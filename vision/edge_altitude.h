// Behaviour: height from edge statistics (thesis section 7.2; vision/kernels/edge_height.h). Attitude moves the
// horizon; without it the camera is taken as level on its mount and the spread is widened. Edges per metre are given,
// or
// (`estimate_lambda`) found out in flight from changes of height that inertia measures (8.1.3;
// vision/kernels/edge_density.h); until the first such change the given value holds.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/edge_density.h"
#include "vision/kernels/edge_height.h"
#include "vision/kernels/edge_rows.h"

namespace wasp::vision {

struct EdgeAltitude {
  static constexpr std::string_view kName = "edge_altitude";
  static constexpr DurationNs kBudgetNs = 3 * kMillisecond;
  static constexpr Stream kStream = Stream::kGray;

  /// Index into CueBody::detail. kEdgesPerM and its sigma are those in use; sigma is 0 for a given, not estimated
  /// value.
  enum Detail {
    kModeHeight_m,
    kEdgesPerHeight,
    kMisfit,
    kEdgeShare,
    kThreshold,
    kEdgesPerM,
    kEdgesPerMSigma,
    kRawHeight_m
  };

  struct Params {
    CameraGeometry camera;
    EdgeHeightParams height;
    int min_threshold = 8;     ///< Sobel units, see EdgeRowsParams
    float max_misfit = 0.25f;  ///< distribution model: a larger gap is no Poisson floor
    float smoothing_s = 0.3f;  ///< time constant of the low pass; 0: none
    int estimate_lambda = 0;   ///< 1: height.edges_per_m is a first guess only
    EdgeDensityParams density;
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
    visit("estimate_lambda", p.estimate_lambda, 0, 1);
    visit("lambda_window_s", p.density.window_s, 1.0, 60.0);
    visit("lambda_climb_sigma_mps", p.density.climb_sigma_mps, 0.001, 5.0);
    visit("lambda_bias_sigma_mps2", p.density.bias_sigma_mps2, 0.001, 1.0);
    visit("lambda_min_excitation_m", p.density.min_excitation_m, 0.0, 10.0);
    visit("lambda_max_sigma_share", p.density.max_sigma_share, 0.01, 1.0);
  }

  /// The filter's memory: what it last said and when. And what is known of lambda.
  struct State {
    TimeNs filtered_at_ns = kNever;
    float filtered_height_m = 0;
    EdgeDensityState density;
  };

  /// height_m: camera centre above the floor, low-passed. quality: 1 - misfit / max_misfit (count model: 0.5).
  /// detail: (7.36)'s height, mu, misfit, edge share, threshold, lambda and its sigma, and the height of this frame
  /// alone. A lambda not known but assumed widens no spread; an estimated one adds its own. A frame older than the last
  /// one, or a gap above 1 s, restarts the filter. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<EdgeAltitude>);

}  // namespace wasp::vision
