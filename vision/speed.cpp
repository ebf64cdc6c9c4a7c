#include "vision/speed.h"

#include <algorithm>
#include <cmath>

namespace wasp::vision {

CueBody Speed::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  LevelFlow flow;
  level_flow(params.camera, input.flow, FlowKind::kStill, flow);
  const SideBalance sides = side_balance(params.sides, flow);
  if (!sides.valid || !(params.flow_radps > 0.f)) return cue;
  const float measured = 0.5f * (sides.left + sides.right);
  const TimeNs now_ns = input.flow->exposed_at_ns;
  const float since_s = state.started ? elapsed_s(state.last_ns, now_ns) : 0.f;
  const float dt_s = since_s < kMaxFlowInterval_s ? since_s : 0.f;
  const float share = dt_s > 0.f ? 1.f - std::exp(-dt_s / std::max(1e-3f, params.smoothing_s)) : 1.f;
  state.flow_radps += share * (measured - state.flow_radps);
  state.last_ns = now_ns;
  state.started = true;
  const float pitch_rad = pitch_for_ratio(params.ratio, state.flow_radps, params.flow_radps, dt_s, state.ratio);
  if (!std::isfinite(pitch_rad)) {
    state = {};
    return cue;
  }
  cue.validity = Validity::kValid;
  cue.has_pitch = 1;
  cue.pitch_rad = pitch_rad;
  cue.quality = std::min(1.f, static_cast<float>(sides.cells_left + sides.cells_right) / 30.f);
  cue.detail = {state.flow_radps,
                sides.left,
                sides.right,
                state.ratio.integral_rad,
                static_cast<float>(sides.cells_left),
                static_cast<float>(sides.cells_right)};
  return cue;
}

}  // namespace wasp::vision
