// Behaviour: height above the floor from depth (thesis section 6.2, in its mended form: vision/kernels/depth_plane.h).
// Attitude says which way is up, so that a wall or a bench front is not taken for the floor, and turns the
// perpendicular height into height along the world vertical. Without attitude it goes by the camera's mount alone.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/depth_plane.h"

namespace wasp::vision {

struct GroundAltitude {
  static constexpr std::string_view kName = "ground_altitude";
  static constexpr DurationNs kBudgetNs = 2 * kMillisecond;
  static constexpr Stream kStream = Stream::kDepth;

  /// Index into CueBody::detail.
  enum Detail { kNormalX, kNormalY, kNormalZ, kPerpendicular_m, kInlierShare, kBelowShare, kRms_m, kTilt_rad };

  struct Params {
    CameraGeometry camera;
    DepthPlaneParams plane;
    float max_slope_rad = 0.1745f;             ///< floor slope allowed against gravity (10 degrees) ...
    float attitude_tolerance_rad = 0.0524f;    ///< ... plus what attitude and mount may be wrong by (3 degrees)
    float max_tilt_no_attitude_rad = 0.9599f;  ///< cone about the mount's up when attitude is absent (55 degrees)
    float scale_sigma = 0.005f;                ///< depth scale error of the sensor, share of the height
    float max_height_m = 10.f;                 ///< estimates above are refused
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("max_slope_rad", p.max_slope_rad, 0.0, 0.8);
    visit("attitude_tolerance_rad", p.attitude_tolerance_rad, 0.0, 0.5);
    visit("max_tilt_no_attitude_rad", p.max_tilt_no_attitude_rad, 0.0, 1.5);
    visit("scale_sigma", p.scale_sigma, 0.0, 0.2);
    visit("max_height_m", p.max_height_m, 0.5, 100.0);
  }

  struct State {
    DepthPlaneState plane;
  };

  /// height_m: camera centre above the floor along the world vertical (perpendicular when attitude is absent).
  /// quality: 0 ... 1, inlier share of valid samples times share of valid samples, saturating at a tenth.
  /// detail: floor normal in camera axes, perpendicular height, inlier share, below share, rms residual, and the angle
  /// between the normal and the prior's up. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<GroundAltitude>);

}  // namespace wasp::vision
