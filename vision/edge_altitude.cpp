// Count edges by row, fit the height, low-pass it.
#include "vision/edge_altitude.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/camera_model.h"

namespace wasp::vision {
namespace {

constexpr DurationNs kLongestGap = kSecond;
constexpr float kNoAttitudeSpread = 0.15f;  // of the height, added in quadrature

/// First-order low pass on irregular samples: weight 1 - exp(-dt / tau).
float smooth(const EdgeAltitude::Params& p, TimeNs now_ns, float height_m, EdgeAltitude::State& state) noexcept {
  const bool known = state.filtered_at_ns != kNever && now_ns > state.filtered_at_ns &&
                     now_ns / 2 - state.filtered_at_ns / 2 < kLongestGap / 2;  // halves cannot overflow
  float weight = 1.f;
  if (known && p.smoothing_s > 0.f && std::isfinite(state.filtered_height_m)) {
    const auto dt_s = static_cast<float>(to_seconds(now_ns - state.filtered_at_ns));
    weight = 1.f - std::exp(-dt_s / p.smoothing_s);
  }
  state.filtered_height_m =
      weight < 1.f ? state.filtered_height_m + weight * (height_m - state.filtered_height_m) : height_m;
  state.filtered_at_ns = now_ns;
  return state.filtered_height_m;
}

/// Lambda in use.
EdgeDensity density_in_use(const EdgeAltitude::Params& p, const EdgeAltitude::State& state) noexcept {
  const bool estimated = p.estimate_lambda != 0 && state.density.density.accepted > 0;
  return estimated ? state.density.density : EdgeDensity{p.height.edges_per_m, 0.f, 0};
}

/// Specific force to upward acceleration: -(R_ned_body f)_z - g. NaN without attitude, which no estimate uses.
double up_acceleration_mps2(const BehaviourInput& input, bool attitude) noexcept {
  constexpr float kGravity_mps2 = 9.80665f;
  const auto& q = input.attitude.q_ned_body;
  const auto& f = input.accel_body_mps2;
  if (!attitude || !input.accel_valid) return NAN;
  const Vec3 force_ned = Quat(q[0], q[1], q[2], q[3]).normalized() * Vec3(f[0], f[1], f[2]);
  return static_cast<double>(-force_ned.z() - kGravity_mps2);
}

/// Refines lambda; the filtered height goes along, so that a new lambda makes no ramp.
void learn(const EdgeAltitude::Params& p, const BehaviourInput& input, const EdgeHeight& e, bool attitude,
           EdgeAltitude::State& state) noexcept {
  if (p.estimate_lambda == 0) return;
  const float before = density_in_use(p, state).edges_per_m;
  const double up_mps2 = up_acceleration_mps2(input, attitude);
  const double mu = e.valid && e.misfit <= p.max_misfit ? static_cast<double>(e.edges_per_height) : 0.0;
  observe_edge_density(p.density, input.exposed_at_ns, mu, std::isfinite(up_mps2), up_mps2, p.height.edges_per_m,
                       state.density);
  state.filtered_height_m *= before / density_in_use(p, state).edges_per_m;
}

void fill_detail(const EdgeHeight& e, const EdgeRows& rows, const EdgeDensity& density, CueBody& cue) noexcept {
  using D = EdgeAltitude::Detail;
  cue.detail[D::kModeHeight_m] = e.mode_height_m;
  cue.detail[D::kEdgesPerHeight] = e.edges_per_height;
  cue.detail[D::kMisfit] = e.misfit;
  cue.detail[D::kEdgeShare] = e.edge_share;
  cue.detail[D::kThreshold] = static_cast<float>(rows.threshold);
  cue.detail[D::kEdgesPerM] = density.edges_per_m;
  cue.detail[D::kEdgesPerMSigma] = density.sigma;
  cue.detail[D::kRawHeight_m] = e.height_m;
}

}  // namespace

CueBody EdgeAltitude::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  const Intrinsics& k = params.camera.intrinsics;
  if (!usable(k) || !input.gray.valid() || input.gray.width_px != k.width_px || input.gray.height_px != k.height_px)
    return cue;
  const bool attitude = input.attitude_valid && attitude_usable(input.attitude.q_ned_body);
  const Vec3 up_cam =
      up_in_camera(params.camera, attitude ? input.attitude.q_ned_body : std::array{1.f, 0.f, 0.f, 0.f});
  EdgeRowsParams rows_params{.min_threshold = params.min_threshold};
  rows_params.kind = suitable_kind(suitable_model(params.height, k, up_cam));
  EdgeRows rows;
  count_edge_rows(rows_params, input.gray, {}, rows);
  EdgeHeightParams height = params.height;
  height.edges_per_m = density_in_use(params, state).edges_per_m;
  EdgeHeight e = estimate_edge_height(height, k, up_cam, rows);
  learn(params, input, e, attitude, state);
  if (!e.valid || !(e.misfit <= params.max_misfit)) return cue;
  const EdgeDensity density = density_in_use(params, state);
  const float rescale = height.edges_per_m / density.edges_per_m;
  e.height_m *= rescale;
  e.mode_height_m *= rescale;
  e.height_sigma_m = std::hypot(rescale * e.height_sigma_m, e.height_m * density.sigma / density.edges_per_m);
  cue.validity = Validity::kValid;
  cue.has_height = 1;
  cue.height_m = smooth(params, input.exposed_at_ns, e.height_m, state);
  cue.height_sigma_m = std::hypot(e.height_sigma_m, attitude ? 0.f : kNoAttitudeSpread * e.height_m);
  cue.quality = e.model == EdgeModel::kCount ? 0.5f : std::clamp(1.f - e.misfit / params.max_misfit, 0.f, 1.f);
  fill_detail(e, rows, density, cue);
  return cue;
}

}  // namespace wasp::vision
