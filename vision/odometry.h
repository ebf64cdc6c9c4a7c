// Behaviour: velocity over ground from optical flow and depth. A still point at depth X along the ray e is seen along
// e' once the camera has moved by t (flow without the camera's turn): X (e' - e) = t_z e' - t_xy, exactly. Two linear
// equations a cell in t: consensus over pairs of cells starts, reweighted least squares (Tukey's biweight) polishes,
// and what moves by itself or has a wrong depth drops out. The attitude's turn is not exact; what is left of it is
// solved for together with t under its own prior. t becomes the body's velocity (lever arm of the camera taken out)
// along the heading and to its right. Source: section 6.1.3 read backwards (flow_depth.h), derived here; the odometer
// of image motion alone is the honeybee's (2.1.4.7).
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"

namespace wasp::vision {

struct Odometry {
  static constexpr std::string_view kName = "odometry";
  static constexpr DurationNs kBudgetNs = kMillisecond;
  static constexpr Stream kStream = Stream::kFlow;

  /// Index into CueBody::detail.
  enum Detail {
    kClimb_mps,
    kClimbSigma_mps,
    kCells,  ///< with flow and depth
    kInliers,
    kResidual_px,      ///< rms per axis over the inliers, scaled to the flow of a cell without error of depth
    kTurnLeft_rad,     ///< angle of the turn that the attitude missed
    kDistance_m,       ///< horizontal, along the path, since start; what noise adds is taken off
    kImageMotion_rad,  ///< integral of the mean image motion without the camera's turn, since start
  };

  struct Params {
    CameraGeometry camera;
    float flow_sigma_px = 0.1f;       ///< least credible noise of one cell and axis
    float depth_sigma = 0.01f;        ///< of the depth: this share of it ...
    float depth_sigma_1pm = 0.0015f;  ///< ... and this times its square [1/m] (Kinect: 1.42e-3)
    float min_depth_m = 0.3f, max_depth_m = 8.f;
    float inlier_sigmas = 10.f;  ///< of the expected error: see FlowMotionParams
    float turn_sigma_rad =
        0.002f;  ///< of the attitude's turn between two frames, each axis; too large costs nothing measurable
    int min_inliers = 10;
    float min_inlier_share = 0.5f;
    float max_sigma_mps = 0.3f;  ///< less certain is blind
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("flow_sigma_px", p.flow_sigma_px, 0.001, 5.0);
    visit("depth_sigma", p.depth_sigma, 0.0, 0.3);
    visit("depth_sigma_1pm", p.depth_sigma_1pm, 0.0, 0.1);
    visit("min_depth_m", p.min_depth_m, 0.05, 10.0);
    visit("max_depth_m", p.max_depth_m, 0.5, 100.0);
    visit("inlier_sigmas", p.inlier_sigmas, 1.0, 20.0);
    visit("turn_sigma_rad", p.turn_sigma_rad, 0.0, 0.05);
    visit("min_inliers", p.min_inliers, 4, FlowField::kMaxColumns * FlowField::kMaxRows);
    visit("min_inlier_share", p.min_inlier_share, 0.1, 1.0);
    visit("max_sigma_mps", p.max_sigma_mps, 0.01, 10.0);
  }

  struct State {
    TimeNs last_at_ns = 0;
    bool has_last = false;
    double distance_m = 0, image_motion_rad = 0;
  };

  /// velocity_forward_mps, velocity_right_mps: mean over the interval of the flow, level, along the heading at its end.
  /// Blind without a turn known from attitude, below min_inliers, or above max_sigma_mps; the odometers then stand
  /// still (that of image motion needs no depth and goes on). quality: inlier share. Survives any input.
  /// Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<Odometry>);

}  // namespace wasp::vision
