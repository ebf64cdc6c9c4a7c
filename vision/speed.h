// Behaviour: speed by constant lateral flow (thesis 2.1.4.4): a bee holds the image speed of the walls, and so flies
// slower where it is narrow. Pitch, nose down to go faster, from the logarithm of flow over setpoint.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/log_ratio.h"
#include "vision/kernels/side_balance.h"

namespace wasp::vision {

struct Speed {
  static constexpr std::string_view kName = "speed";
  static constexpr DurationNs kBudgetNs = 1 * kMillisecond;
  static constexpr Stream kStream = Stream::kFlow;

  /// Index into CueBody::detail. kFlow_radps: mean of both sides, filtered.
  enum Detail { kFlow_radps, kLeft_radps, kRight_radps, kIntegral_rad, kCellsLeft, kCellsRight };

  struct Params {
    CameraGeometry camera;
    SideParams sides{.measure = SideMeasure::kImageSpeed, .least_azimuth_rad = 0.44f};
    float flow_radps = 0.25f;  ///< setpoint, mean over the wedges of both sides; > 0
    float smoothing_s = 0.1f;  ///< time constant of the filter on the flow
    RatioParams ratio;
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("least_azimuth_rad", p.sides.least_azimuth_rad, 0.05, 1.5);
    visit("greatest_azimuth_rad", p.sides.greatest_azimuth_rad, 0.1, 2.8);
    visit("greatest_elevation_rad", p.sides.greatest_elevation_rad, 0.05, 1.5);
    visit("min_cells", p.sides.min_cells, 1, 96);
    visit("flow_radps", p.flow_radps, 0.02, 5.0);
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

  /// pitch_rad, within +-max_pitch_rad. Blind without a de-rotated field or with too few cells on a side; the integral
  /// waits. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<Speed>);

}  // namespace wasp::vision
