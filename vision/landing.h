// Behaviour: grazing landing at constant ventral flow (thesis 2.1.4.6). A bee that lands keeps the ground's image speed
// constant: omega = v/h. Here pitch holds forward ventral flow at its setpoint, and the height is to fall by a constant
// share a second, dh/dt = -k h; then v = omega h, dx/dh = -omega/k: a straight line to the ground, on which both speeds
// go to zero as the height does. Nobody needs to know v or h.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/log_ratio.h"
#include "vision/kernels/ventral_flow.h"

namespace wasp::vision {

struct Landing {
  static constexpr std::string_view kName = "landing";
  static constexpr DurationNs kBudgetNs = 1 * kMillisecond;
  static constexpr Stream kStream = Stream::kFlowDown;

  /// Index into CueBody::detail.
  enum Detail { kForward_radps, kRight_radps, kSinking_1ps, kSigma_radps, kFiltered_radps, kIntegral_rad, kCells };

  struct Params {
    CameraGeometry camera;
    VentralParams ventral;
    float flow_radps = 0.5f;    ///< setpoint of forward ventral flow; > 0
    float descent_1ps = 0.15f;  ///< share of the height to lose each second
    float smoothing_s = 0.1f;   ///< time constant of the filter on the flow
    RatioParams ratio{.p_rad = 0.08f};
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("half_angle_rad", p.ventral.half_angle_rad, 0.1, 1.2);
    visit("min_cells", p.ventral.min_cells, 2, 192);
    visit("max_sigma_radps", p.ventral.max_sigma_radps, 0.01, 5.0);
    visit("flow_radps", p.flow_radps, 0.02, 5.0);
    visit("descent_1ps", p.descent_1ps, 0.0, 1.0);
    visit("smoothing_s", p.smoothing_s, 0.0, 2.0);
    visit("p_rad", p.ratio.p_rad, 0.0, 1.0);
    visit("i_radps", p.ratio.i_radps, 0.0, 1.0);
    visit("max_pitch_rad", p.ratio.max_pitch_rad, 0.0, 0.35);
  }

  struct State {
    TimeNs last_ns = 0;
    bool started = false;
    float flow_radps = 0;
    RatioState ratio;
  };

  /// pitch_rad, and a climb of -descent_1ps * height. Blind when ventral flow cannot be measured: then no descent
  /// either. quality: 1 / (1 + sigma / setpoint). Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<Landing>);

}  // namespace wasp::vision
