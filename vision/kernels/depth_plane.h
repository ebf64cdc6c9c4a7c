// The floor in a depth image, in constant time: 1,200 fixed samples in (x, y, 1/z), a bounded number of candidate
// planes (last frame's, gravity's, three-point draws), consensus with a penalty for whatever lies BELOW a candidate,
// and a least-squares polish over the samples that agree. This is the mended form of thesis section 6.2; the printed
// randomized Hough transform is vision/kernels/hough_plane.h.
//
// What makes a plane the floor, without being told: its normal is near "up", it carries a fair share of the samples,
// and next to nothing lies below it. Nobody sees through a floor; a table or a box top has the floor below it.
#pragma once

#include "types/camera.h"
#include "types/image_view.h"
#include "types/realtime.h"
#include "vision/kernels/depth_samples.h"
#include "vision/kernels/plane_fit.h"
#include "vision/kernels/pseudo_random.h"

namespace wasp::vision {

struct DepthPlaneParams {
  DepthRange range;
  /// One sigma of inverse depth. First-generation Kinect: 0.0014 /m of noise (Khoshelham and Elberink 2012,
  /// 1.4 mm at 1 m growing with z^2; its disparity steps are 0.0029 /m) and as much again of uncorrected lens error.
  float sensor_sigma_per_m = 0.002f;
  float flatness_m = 0.01f;        ///< how uneven a floor may be
  float min_inlier_share = 0.06f;  ///< of the valid samples
  int min_inliers = 40;            ///< of kSampleCount
  float max_below_share = 0.04f;   ///< samples below the plane, of the valid samples ...
  float max_below_ratio = 0.3f;    ///< ... and of the inliers
  float max_normal_sigma_rad = 0.035f;
};

/// Which way is up, and how sure of it the caller is.
struct GravityPrior {
  Vec3 up_cam{0.f, -0.8660254f, -0.5f};  ///< unit; the default suits a camera that looks 30 degrees down
  float max_angle_rad = 0.96f;           ///< a floor's normal lies within this cone (default 55 degrees)
  bool measured = false;                 ///< from attitude: also try candidates whose normal is exactly up
};

struct PlaneEstimate {
  bool valid = false;
  Vec3 normal_cam = Vec3::Zero();  ///< unit, towards the camera's side: n . X = -height for X on the floor
  float height_m = 0;              ///< perpendicular distance of the camera centre
  float height_sigma_m = 0;        ///< one sigma of the fit (noise only)
  float normal_sigma_rad = 0;
  float inlier_share = 0;  ///< of the valid samples
  float below_share = 0;
  float valid_share = 0;  ///< valid samples of all samples
  float rms_m = 0;        ///< perpendicular residual of the inliers
  int draws = 0;          ///< three-point draws it took, also when invalid; at most kMaxPlaneDraws
};

inline constexpr int kMaxPlaneDraws = 3 * 512;

/// All memory of the estimator.
struct DepthPlaneState {
  PseudoRandom random;
  bool warm = false;
  InversePlane last;
  float last_share = 0;  ///< inlier share of the last frame
  SampleTable table;
};

/// One frame. `depth` is uint16 millimetres, 0 and 65535 invalid, of the size the intrinsics name; anything else, or
/// parameters that are not finite, give an invalid estimate. Bounded: at most three rounds of 512
/// draws, the second and third only when the one before found no floor; fewer draws where a plane carries so many
/// samples that they suffice, and 64 where last frame's plane holds and nothing lies below it. Realtime-safe: yes.
PlaneEstimate estimate_floor(const DepthPlaneParams& params, const Intrinsics& intrinsics, const DepthView& depth,
                             const GravityPrior& prior, DepthPlaneState& state) WASP_REALTIME;

}  // namespace wasp::vision
