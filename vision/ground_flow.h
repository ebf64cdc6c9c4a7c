// Behaviour: what a downward flow sensor would say (PX4FLOW and its like; MAVLink OPTICAL_FLOW_RAD): the angle by which
// the ground below turns past the sensor, rotation and translation together, and the turn alone. Each cell's two
// directions become points of the level plane below the camera; level ground moves there by a similarity, whose shift
// is the way over height (vision/kernels/similarity_fit.h). That and the turn between the frames are put together for
// the body's own down axis. It says nothing to control.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/similarity_fit.h"

namespace wasp::vision {

struct GroundFlow {
  static constexpr std::string_view kName = "ground_flow";
  static constexpr DurationNs kBudgetNs = kMillisecond;
  static constexpr Stream kStream = Stream::kFlowDown;

  /// Index into CueBody::detail. Right-handed about body x and y: still ground under a vehicle that goes to its right
  /// gives negative x, one that goes forward positive y.
  enum Detail {
    kFlowX_rad,
    kFlowY_rad,
    kTurnX_rad,  ///< of the body between the frames, by attitude
    kTurnY_rad,
    kTurnZ_rad,
    kInterval_s,
    kSlant,       ///< distance along the body's down axis over the height
    kResidual_px  ///< of the fit
  };

  struct Params {
    CameraGeometry camera;
    float max_angle_rad = 0.9f;  ///< cells farther from straight down are not used
    float max_tilt_rad = 0.6f;   ///< beyond it nothing is said
    float inlier_px = 2.f;       ///< see SimilarityFitParams
    int min_cells = 8;
    float min_inlier_share = 0.4f;
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("max_angle_rad", p.max_angle_rad, 0.1, 1.4);
    visit("max_tilt_rad", p.max_tilt_rad, 0.05, 1.2);
    visit("inlier_px", p.inlier_px, 0.1, 20.0);
    visit("min_cells", p.min_cells, 3, FlowField::kMaxColumns * FlowField::kMaxRows);
    visit("min_inlier_share", p.min_inlier_share, 0.1, 1.0);
  }

  struct State {};

  /// Blind without the turn from attitude, and where the fit is. quality: inlier share. Survives any input.
  /// Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<GroundFlow>);

}  // namespace wasp::vision
