// Level, sides, balance, filter, lead, wish.
#include "vision/flow_balance.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/balance_template.h"

namespace wasp::vision {
namespace {

/// First-order filter; starts anew after a gap or when time went backwards.
void smooth(const FlowBalance::Params& p, TimeNs now_ns, float balance, FlowBalance::State& s) noexcept {
  const float dt_s = s.started ? elapsed_s(s.last_ns, now_ns) : 0.f;
  const bool follows = dt_s > 0.f && dt_s < kMaxFlowInterval_s;
  const float share = follows ? 1.f - std::exp(-dt_s / std::max(1e-3f, p.smoothing_s)) : 1.f;
  s.balance += share * (balance - s.balance);
  s.last_ns = now_ns;
  s.started = true;
}

/// Mean over ten frames (6.16) of the template's force about the principal point.
float gross_force_px(const FlowBalance::Params& p, const FlowMessage& flow, FlowBalance::State& s) noexcept {
  const Intrinsics& k = p.camera.intrinsics;
  const GrossForce force = gross_force({}, flow.still, k.cx_px, k.cy_px);
  s.gross_px[static_cast<std::size_t>(s.gross_count % 10)] = std::isfinite(force.force.x) ? force.force.x : 0.f;
  s.gross_count = s.gross_count >= 20 ? 11 : s.gross_count + 1;
  float sum = 0.f;
  for (const float each : s.gross_px) sum += each;
  return sum / static_cast<float>(std::min(s.gross_count, 10));
}

float wish(const FlowBalance::Params& p, const SideBalance& sides, float passing_1ps, float yaw_rate_radps,
           float balance) noexcept {
  const float gain = std::min(p.gain * passing_1ps, p.max_gain_radps);
  const float cotangent = sides.mean_cosine / sides.mean_sine;
  const float ahead = balance + cotangent * p.lead_s * yaw_rate_radps;
  return std::clamp(-gain * ahead, -p.max_rate_radps, p.max_rate_radps);
}

}  // namespace

CueBody FlowBalance::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  LevelFlow flow;
  level_flow(params.camera, input.flow, FlowKind::kStill, flow);
  const SideBalance sides = side_balance(params.sides, flow);
  const float sum = sides.left + sides.right;
  if (!sides.valid || !(sides.mean_sine > 0.f) || !(sum > 0.f)) return cue;
  const float passing_1ps = 0.5f * sum / sides.mean_sine;
  if (!(passing_1ps >= params.least_passing_1ps) || !std::isfinite(flow.yaw_rate_radps)) return cue;
  smooth(params, input.flow->exposed_at_ns, std::clamp((sides.right - sides.left) / sum, -1.f, 1.f), state);
  const float rate_radps = wish(params, sides, passing_1ps, flow.yaw_rate_radps, state.balance);
  if (!std::isfinite(rate_radps)) return cue;
  cue.validity = Validity::kValid;
  cue.has_heading_rate = 1;
  cue.heading_rate_radps = rate_radps;
  cue.quality = std::min(1.f, static_cast<float>(sides.cells_left + sides.cells_right) / 40.f);
  cue.detail = {sides.left,
                sides.right,
                state.balance,
                passing_1ps,
                flow.yaw_rate_radps,
                static_cast<float>(sides.cells_left),
                static_cast<float>(sides.cells_right),
                gross_force_px(params, *input.flow, state)};
  return cue;
}

}  // namespace wasp::vision
