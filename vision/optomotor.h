// Behaviour: the optomotor response (thesis 2.1.4.1): a fly turns with what it sees turn, and so keeps its heading. The
// field as seen, not de-rotated: no gyro takes part. A point at azimuth A of an upright wall at distance d moves at
//     A' = -r + v/d sin(A + psi) sin A = -r + c1 sin^2 A + c2 |sin A| cos A, with c1, c2 of its side's own,
// r the yaw rate wanted: a robust fit of r and of what translation adds, which vanishes straight ahead. Hovering, the
// translation's part is near zero and r is all there is. With `hold_1ps` the visual yaw rate is also summed, with a
// leak, to a heading error, and held at zero.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/level_flow.h"

namespace wasp::vision {

struct Optomotor {
  static constexpr std::string_view kName = "optomotor";
  static constexpr DurationNs kBudgetNs = 1 * kMillisecond;
  static constexpr Stream kStream = Stream::kFlow;

  /// Index into CueBody::detail. kGyro_radps: the yaw rate by the message's rotation, for comparison only.
  enum Detail { kYawRate_radps, kHeading_rad, kSigma_radps, kLeftPassing, kRightPassing, kGyro_radps, kCells };

  struct Params {
    CameraGeometry camera;
    float greatest_elevation_rad = 0.6f;  ///< of cells that take part, up or down
    int min_cells = 10;
    float max_sigma_radps = 0.1f;  ///< a less certain yaw rate is none
    float gain = 0.5f;             ///< wish over visual yaw rate, opposite sign
    float hold_1ps = 0.f;          ///< wish over summed heading error; 0: no heading hold
    float leak_s = 5.f;            ///< the heading error is forgotten with this time constant
    float max_rate_radps = 0.5f;
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("greatest_elevation_rad", p.greatest_elevation_rad, 0.05, 1.5);
    visit("min_cells", p.min_cells, 4, 192);
    visit("max_sigma_radps", p.max_sigma_radps, 0.001, 5.0);
    visit("gain", p.gain, 0.0, 5.0);
    visit("hold_1ps", p.hold_1ps, 0.0, 5.0);
    visit("leak_s", p.leak_s, 0.1, 1000.0);
    visit("max_rate_radps", p.max_rate_radps, 0.0, 2.0);
  }

  struct State {
    TimeNs last_ns = 0;
    bool started = false;
    float heading_rad = 0;  ///< summed visual turn, clockwise
  };

  /// heading_rate_radps against the visual turn. Blind with too few cells or too uncertain a rate. quality: inverse of
  /// 1 + sigma / max_sigma. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<Optomotor>);

}  // namespace wasp::vision
