#include "vision/landing.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {
namespace {

/// Filters the flow and returns the time since the last one, 0 after a gap or when time went backwards.
float smooth(const Landing::Params& p, TimeNs now_ns, float flow_radps, Landing::State& s) noexcept {
  const float since_s = s.started ? elapsed_s(s.last_ns, now_ns) : 0.f;
  const float dt_s = since_s < kMaxFlowInterval_s ? since_s : 0.f;
  const float share = dt_s > 0.f ? 1.f - std::exp(-dt_s / std::max(1e-3f, p.smoothing_s)) : 1.f;
  s.flow_radps += share * (flow_radps - s.flow_radps);
  s.last_ns = now_ns;
  s.started = true;
  return dt_s;
}

}  // namespace

CueBody Landing::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  LevelFlow flow;
  level_flow(params.camera, input.flow, FlowKind::kStill, flow);
  const VentralFlow ventral = ventral_flow(params.ventral, flow);
  if (!ventral.valid || !(params.flow_radps > 0.f)) return cue;
  const float dt_s = smooth(params, input.flow->exposed_at_ns, ventral.forward_radps, state);
  const float pitch_rad = pitch_for_ratio(params.ratio, state.flow_radps, params.flow_radps, dt_s, state.ratio);
  if (!std::isfinite(pitch_rad)) {
    state = {};
    return cue;
  }
  cue.validity = Validity::kValid;
  cue.has_pitch = cue.has_climb = 1;
  cue.pitch_rad = pitch_rad;
  cue.climb_1ps = -params.descent_1ps;
  cue.quality = 1.f / (1.f + ventral.sigma_radps / params.flow_radps);
  cue.detail = {ventral.forward_radps,
                ventral.right_radps,
                ventral.sinking_1ps,
                ventral.sigma_radps,
                state.flow_radps,
                state.ratio.integral_rad,
                static_cast<float>(ventral.cells)};
  return cue;
}

}  // namespace wasp::vision
