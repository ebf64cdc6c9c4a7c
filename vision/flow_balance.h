// Behaviour: the gross process of the balance strategy (thesis 6.1, algorithms.md section 6): turn away from the side
// that flows faster. The thesis' flights swung from wall to wall; this is why, and what is done about it.
//
// A corridor of half width a; y to the right of its middle, psi the heading clockwise from its axis; speed v along the
// heading. A point of the right wall at azimuth A (from the heading, which is where the focus of expansion is) lies
// (a - y) / sin(A + psi) away, one of the left wall (a + y) / sin(A - psi). Azimuth rate over sin A, the nearness, is
//     R = v sin(A + psi) / (a - y),   L = v sin(A - psi) / (a + y),
// so, to first order, balance b = (R - L) / (R + L) = y / a + psi cot A: free of speed and width, and because the
// wedges are fixed to the heading, not to a focus that would have to be found, it carries the heading's error with
// the sign that damps. With heading rate = -K b and y' = v psi,
//     psi'' + K cot A psi' + K v/a psi = 0,   damping ratio = 1/2 cot A sqrt(K a / v).
// A fixed K is therefore undamped when fast or narrow. Mean nearness over sin A is v/a itself: K = gain * v/a makes the
// damping 1/2 cot A sqrt(gain) at every speed and width. What remains is delay. The thesis averaged ten frames (6.16),
// 1/3 s at 30 Hz in front of a slow heading loop: a limit cycle. Here the filter is a few tens of milliseconds, and
// the turn that is under way, known from the gyro, is added to psi over the time the loop takes (`lead_s`).
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/side_balance.h"

namespace wasp::vision {

struct FlowBalance {
  static constexpr std::string_view kName = "flow_balance";
  static constexpr DurationNs kBudgetNs = 1 * kMillisecond;
  static constexpr Stream kStream = Stream::kFlow;

  /// Index into CueBody::detail. kPassing_1ps is v/a; kGross_px the thesis' force (kernels/balance_template.h, mean of
  /// ten frames), right positive, for figures: it steers nothing.
  enum Detail { kLeft_1ps, kRight_1ps, kBalance, kPassing_1ps, kYawRate_radps, kCellsLeft, kCellsRight, kGross_px };

  struct Params {
    CameraGeometry camera;
    SideParams sides;
    float gain = 1.2f;               ///< K over v/a; damping ratio 1/2 cot A sqrt(gain)
    float max_gain_radps = 1.2f;     ///< K at most, whatever v/a: the loop's delay allows no more
    float lead_s = 0.35f;            ///< lag of the heading loop and age of the cue
    float smoothing_s = 0.04f;       ///< time constant of the filter on b
    float max_rate_radps = 0.6f;     ///< of the wish
    float least_passing_1ps = 0.1f;  ///< v/a below which there is nothing to balance
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("least_azimuth_rad", p.sides.least_azimuth_rad, 0.05, 1.5);
    visit("greatest_azimuth_rad", p.sides.greatest_azimuth_rad, 0.1, 2.8);
    visit("greatest_elevation_rad", p.sides.greatest_elevation_rad, 0.05, 1.5);
    visit("min_cells", p.sides.min_cells, 1, 96);
    visit("gain", p.gain, 0.0, 10.0);
    visit("max_gain_radps", p.max_gain_radps, 0.0, 5.0);
    visit("lead_s", p.lead_s, 0.0, 2.0);
    visit("smoothing_s", p.smoothing_s, 0.0, 1.0);
    visit("max_rate_radps", p.max_rate_radps, 0.0, 2.0);
    visit("least_passing_1ps", p.least_passing_1ps, 0.0, 5.0);
  }

  struct State {
    TimeNs last_ns = 0;
    bool started = false;
    float balance = 0;
    std::array<float, 10> gross_px{};
    int gross_count = 0;
  };

  /// heading_rate_radps: away from the faster side. Blind without a de-rotated field, with too few cells on a side, or
  /// when nothing passes. quality: cells that entered, 1 from 40 on. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<FlowBalance>);

}  // namespace wasp::vision
