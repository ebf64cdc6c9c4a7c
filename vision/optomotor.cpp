#include "vision/optomotor.h"

#include <algorithm>
#include <cmath>

#include "vision/kernels/weighted_fit.h"

namespace wasp::vision {
namespace {

struct VisualTurn {
  bool valid = false;
  float rate_radps = 0, sigma_radps = 0;
  float left_1ps = 0, right_1ps = 0;  ///< v/d of each side
  int cells = 0;
};

using Fit = WeightedFit<5, kMaxFlowPoints>;

/// Unknowns: yaw rate; sin^2 and |sin| cos of the left side, the same of the right. Ridge: what a narrow view cannot
/// tell apart stays small.
VisualTurn visual_turn(const Optomotor::Params& p, const LevelFlow& flow) noexcept {
  VisualTurn out;
  Fit fit;
  for (const LevelCell& cell : flow.view()) {
    if (!cell.moved || !(std::abs(cell.elevation_rad) <= p.greatest_elevation_rad)) continue;
    const float s = std::sin(cell.azimuth_rad), c = std::cos(cell.azimuth_rad);
    Fit::Unknowns row = Fit::Unknowns::Zero();
    row[0] = -1.f;
    if (s < 0.f) {
      row[1] = -s * s, row[2] = -s * c;
    } else {
      row[3] = s * s, row[4] = s * c;
    }
    fit.add(row, cell.azimuth_rate_radps);
  }
  out.cells = fit.count;
  Fit::Unknowns x;
  if (!flow.valid || fit.count < std::max(p.min_cells, 6) || !fit.solve(0.02f, 0.002f, x)) return out;
  out.rate_radps = x[0], out.left_1ps = x[1], out.right_1ps = x[3];
  out.sigma_radps = 3.f * 1.4826f * fit.residual / std::sqrt(static_cast<float>(fit.count));  // 3: five unknowns share
  out.valid = out.sigma_radps <= p.max_sigma_radps;
  return out;
}

void sum_heading(const Optomotor::Params& p, TimeNs now_ns, float rate_radps, Optomotor::State& s) noexcept {
  const float since_s = s.started ? elapsed_s(s.last_ns, now_ns) : 0.f;
  const float dt_s = since_s < kMaxFlowInterval_s ? since_s : 0.f;
  s.heading_rad = s.heading_rad * std::exp(-dt_s / std::max(0.01f, p.leak_s)) + rate_radps * dt_s;
  s.heading_rad = std::clamp(s.heading_rad, -3.14159265f, 3.14159265f);
  s.last_ns = now_ns;
  s.started = true;
}

}  // namespace

CueBody Optomotor::step(const Params& params, const BehaviourInput& input, State& state) noexcept {
  CueBody cue;
  LevelFlow flow;
  level_flow(params.camera, input.flow, FlowKind::kSeen, flow);
  const VisualTurn turn = visual_turn(params, flow);
  if (!turn.valid) return cue;
  sum_heading(params, input.flow->exposed_at_ns, turn.rate_radps, state);
  const float wish = -params.gain * turn.rate_radps - params.hold_1ps * state.heading_rad;
  if (!std::isfinite(wish)) {
    state = {};
    return cue;
  }
  cue.validity = Validity::kValid;
  cue.has_heading_rate = 1;
  cue.heading_rate_radps = std::clamp(wish, -params.max_rate_radps, params.max_rate_radps);
  cue.quality = 1.f / (1.f + turn.sigma_radps / params.max_sigma_radps);
  cue.detail = {turn.rate_radps,
                state.heading_rad,
                turn.sigma_radps,
                turn.left_1ps,
                turn.right_1ps,
                flow.yaw_rate_radps,
                static_cast<float>(turn.cells)};
  return cue;
}

}  // namespace wasp::vision
