// Behaviour: centring (thesis 2.1.4.3): a bee flies where both walls move past its eyes equally fast. Only the cells
// farthest to the side take part, and what is compared is image speed, not depth. heading rate = -gain (R - L) / 2 with
// R, L in rad/s is -gain * (v sin^2 A / a) * (y/a + psi cot A): scheduled by speed and width as flow_balance derives,
// with less damping of its own, because cot A is small to the side; the turn under way (`lead_s`) makes up for that.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/side_balance.h"

namespace wasp::vision {

struct Centring {
  static constexpr std::string_view kName = "centring";
  static constexpr DurationNs kBudgetNs = 1 * kMillisecond;
  static constexpr Stream kStream = Stream::kFlow;

  /// Index into CueBody::detail.
  enum Detail { kLeft_radps, kRight_radps, kBalance, kFromAzimuth_rad, kYawRate_radps, kCellsLeft, kCellsRight };

  struct Params {
    CameraGeometry camera;
    float inner_share = 0.6f;             ///< cells beyond this share of the widest azimuth seen take part
    float greatest_elevation_rad = 0.3f;  ///< of those cells, up or down
    int min_cells = 3;                    ///< on each side
    float gain = 3.f;                     ///< heading rate over half the difference of image speeds
    float lead_s = 0.35f;                 ///< lag of the heading loop and age of the cue
    float max_rate_radps = 0.5f;          ///< of the wish
    float least_speed_radps = 0.03f;      ///< mean image speed below which nothing passes
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("inner_share", p.inner_share, 0.1, 0.9);
    visit("greatest_elevation_rad", p.greatest_elevation_rad, 0.05, 1.5);
    visit("min_cells", p.min_cells, 1, 96);
    visit("gain", p.gain, 0.0, 20.0);
    visit("lead_s", p.lead_s, 0.0, 2.0);
    visit("max_rate_radps", p.max_rate_radps, 0.0, 2.0);
    visit("least_speed_radps", p.least_speed_radps, 0.0, 2.0);
  }

  struct State {};  // no memory: a bee's answer to one field

  /// heading_rate_radps: away from the side whose image moves faster. Blind without a de-rotated field, with too few
  /// cells on a side, or when nothing passes. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<Centring>);

}  // namespace wasp::vision
