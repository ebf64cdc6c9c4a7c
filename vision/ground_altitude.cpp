// Prior from attitude, estimate, gate, cue.
#include "vision/ground_altitude.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/camera_model.h"

namespace wasp::vision {
namespace {

GravityPrior gravity_prior(const GroundAltitude::Params& p, const BehaviourInput& input, bool attitude) noexcept {
  constexpr std::array<float, 4> kLevel{1.f, 0.f, 0.f, 0.f};
  return {.up_cam = up_in_camera(p.camera, attitude ? input.attitude.q_ned_body : kLevel),
          .max_angle_rad = attitude ? p.max_slope_rad + p.attitude_tolerance_rad : p.max_tilt_no_attitude_rad,
          .measured = attitude};
}

void fill_detail(const PlaneEstimate& e, float cosine, CueBody& cue) noexcept {
  using D = GroundAltitude::Detail;
  cue.detail[D::kNormalX] = e.normal_cam.x();
  cue.detail[D::kNormalY] = e.normal_cam.y();
  cue.detail[D::kNormalZ] = e.normal_cam.z();
  cue.detail[D::kPerpendicular_m] = e.height_m;
  cue.detail[D::kInlierShare] = e.inlier_share;
  cue.detail[D::kBelowShare] = e.below_share;
  cue.detail[D::kRms_m] = e.rms_m;
  cue.detail[D::kTilt_rad] = std::acos(std::clamp(cosine, -1.f, 1.f));
}

}  // namespace

CueBody GroundAltitude::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  const bool attitude = input.attitude_valid && attitude_usable(input.attitude.q_ned_body);
  const GravityPrior prior = gravity_prior(params, input, attitude);
  const PlaneEstimate e = estimate_floor(params.plane, params.camera.intrinsics, input.depth, prior, state.plane);
  if (!e.valid) return cue;
  const float cosine = e.normal_cam.dot(prior.up_cam);
  const float height_m = attitude ? e.height_m / cosine : e.height_m;
  const float sigma_m = std::hypot(e.height_sigma_m, params.scale_sigma * height_m);
  if (!(height_m > 0.f && height_m <= params.max_height_m) || !std::isfinite(sigma_m)) return cue;
  cue.validity = Validity::kValid;
  cue.has_height = 1;
  cue.height_m = height_m;
  cue.height_sigma_m = sigma_m;
  cue.quality = std::min(1.f, 10.f * e.inlier_share * e.valid_share);
  fill_detail(e, cosine, cue);
  return cue;
}

}  // namespace wasp::vision
