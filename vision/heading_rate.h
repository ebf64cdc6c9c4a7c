// Behaviour: yaw rate and height ratio from the camera that looks down (thesis section 5.3), by a similarity fit to its
// flow (vision/kernels/heading_rate.h says why not by log-polar maps; heading_log_polar.h has those). Each cell's two
// directions, through the fisheye, become points of the level plane at unit distance below the camera at their time:
// roll and pitch go out by attitude, yaw does not. There level ground moves by a similarity, exactly. `scale` is the
// one constant found on a turntable and then held.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/heading_rate.h"
#include "vision/kernels/similarity_fit.h"

namespace wasp::vision {

/// What heading_rate and heading_log_polar say in CueBody::detail.
struct HeadingDetail {
  /// Index into CueBody::detail. Rate and heading clockwise seen from above, times `scale`.
  enum Detail {
    kYawRate_radps,
    kYawRateSigma_radps,
    kHeightRatio,  ///< of the camera's height, second frame over first
    kHeightRatioSigma,
    kCells,  ///< that could be used; for heading_log_polar 0, and so with the next two
    kInliers,
    kResidual_px,
    kHeading_rad,  ///< sum of the turns since start, not wrapped
  };
};

/// From the measured turn to the cue; `interval_s` > 0. Realtime-safe: yes.
void speak_heading(const HeadingRate& turn, float scale, float gain, float interval_s, CueBody& cue) WASP_REALTIME;

struct HeadingRateDown : HeadingDetail {
  static constexpr std::string_view kName = "heading_rate";
  static constexpr DurationNs kBudgetNs = kMillisecond;
  static constexpr Stream kStream = Stream::kFlowDown;

  struct Params {
    CameraGeometry camera;
    float max_angle_rad = 0.96f;  ///< cells farther from straight down are not used (55 degrees)
    float scale = 1.f;            ///< true over measured turn, from a turntable
    float gain = 0.f;             ///< > 0: wish a heading rate of -gain times the measured one
    float max_sigma = 0.02f;      ///< of the turn [rad] and of the height ratio: more is blind
    float inlier_px = 2.f;        ///< see SimilarityFitParams
    int min_cells = 8;
    float min_inlier_share = 0.4f;
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("max_angle_rad", p.max_angle_rad, 0.1, 1.4);
    visit("scale", p.scale, 0.5, 2.0);
    visit("gain", p.gain, 0.0, 5.0);
    visit("max_sigma", p.max_sigma, 0.0001, 0.5);
    visit("inlier_px", p.inlier_px, 0.1, 20.0);
    visit("min_cells", p.min_cells, 3, FlowField::kMaxColumns * FlowField::kMaxRows);
    visit("min_inlier_share", p.min_inlier_share, 0.1, 1.0);
  }

  struct State {
    TimeNs last_at_ns = 0;
    bool has_last = false;
    double heading_rad = 0;
  };

  /// Valid when the fit is. Without attitude the vehicle counts as level: a turn about roll or pitch then looks like
  /// ground that slides, which the fit allows for to first order. has_heading_rate only with `gain`. Survives any
  /// input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<HeadingRateDown>);

}  // namespace wasp::vision
