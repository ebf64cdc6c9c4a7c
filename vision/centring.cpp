#include "vision/centring.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

/// Widest azimuth that both sides of the heading reach.
float widest(const LevelFlow& flow, float greatest_elevation_rad) noexcept {
  float left = 0.f, right = 0.f;
  for (const LevelCell& cell : flow.view()) {
    if (!cell.moved || !(std::abs(cell.elevation_rad) <= greatest_elevation_rad)) continue;
    left = std::max(left, -cell.azimuth_rad);
    right = std::max(right, cell.azimuth_rad);
  }
  return std::min({left, right, 2.4f});
}

}  // namespace

CueBody Centring::step(const Params& params, const BehaviourInput& input, State& /*state*/) noexcept {
  CueBody cue;
  LevelFlow flow;
  level_flow(params.camera, input.flow, FlowKind::kStill, flow);
  const float outer_rad = widest(flow, params.greatest_elevation_rad), inner_rad = params.inner_share * outer_rad;
  const SideBalance sides = side_balance({.measure = SideMeasure::kImageSpeed,
                                          .least_azimuth_rad = inner_rad,
                                          .greatest_azimuth_rad = outer_rad + 0.03f,
                                          .greatest_elevation_rad = params.greatest_elevation_rad,
                                          .min_cells = params.min_cells},
                                         flow);
  const float mean_radps = 0.5f * (sides.left + sides.right), half_radps = 0.5f * (sides.right - sides.left);
  if (!sides.valid || !(mean_radps >= params.least_speed_radps) || !(mean_radps > 0.f)) return cue;
  const float cotangent = sides.mean_cosine / sides.mean_sine;
  const float rate = -params.gain * (half_radps + mean_radps * cotangent * params.lead_s * flow.yaw_rate_radps);
  if (!std::isfinite(rate)) return cue;
  cue.validity = Validity::kValid;
  cue.has_heading_rate = 1;
  cue.heading_rate_radps = std::clamp(rate, -params.max_rate_radps, params.max_rate_radps);
  cue.quality = std::min(1.f, static_cast<float>(sides.cells_left + sides.cells_right) / 20.f);
  cue.detail = {sides.left,
                sides.right,
                half_radps / mean_radps,
                inner_rad,
                flow.yaw_rate_radps,
                static_cast<float>(sides.cells_left),
                static_cast<float>(sides.cells_right)};
  return cue;
}

}  // namespace wasp::vision
