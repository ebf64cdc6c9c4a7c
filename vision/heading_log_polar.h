// Behaviour: yaw rate and height ratio as the thesis has them (section 5.3), phase correlation of log-polar maps of the
// frames of the camera that looks down (vision/kernels/heading_log_polar.h). Needs a still optical centre: for
// comparison and for the turntable; heading_rate.h is the default for flight. Same detail as that one.
#pragma once

#include <string_view>
#include <vector>

#include "vision/heading_rate.h"
#include "vision/kernels/heading_log_polar.h"

namespace wasp::vision {

struct HeadingLogPolarDown : HeadingDetail {
  static constexpr std::string_view kName = "heading_log_polar";
  static constexpr DurationNs kBudgetNs = 5 * kMillisecond;
  static constexpr Stream kStream = Stream::kDown;

  struct Params {
    CameraGeometry camera;
    HeadingLogPolarParams regions;  ///< takes effect when the State is made
    float max_gap_s = 0.2f;         ///< frames farther apart are not compared
    float scale = 1.f;              ///< true over measured turn, from a turntable
    float gain = 0.f;               ///< > 0: wish a heading rate of -gain times the measured one
    float max_sigma = 0.05f;        ///< of the turn [rad] and of the height ratio: more is blind
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("regions", p.regions.regions, 1, kHeadingRegions);
    visit("min_regions", p.regions.min_regions, 1, kHeadingRegions);
    visit("min_variance", p.regions.min_variance, 0.0, 5000.0);
    visit("max_relative_sigma", p.regions.max_relative_sigma, 0.001, 1.0);
    visit("max_gap_s", p.max_gap_s, 0.01, 1.0);
    visit("scale", p.scale, 0.5, 2.0);
    visit("gain", p.gain, 0.0, 5.0);
    visit("max_sigma", p.max_sigma, 0.0001, 0.5);
  }

  struct State {
    /// Takes all memory. Throws std::invalid_argument for parameters out of range or an image without room for a map.
    explicit State(const Params& params);
    HeadingLogPolar maps;
    std::vector<std::uint8_t> packed;  ///< the frame without padding between its rows
    TimeNs last_at_ns = 0;
    bool has_last = false;
    double heading_rad = 0;
  };

  /// Blind for the first frame, after a gap, for time that does not increase (the new frame is kept), an image of
  /// another size (the last frame is forgotten), or when the regions disagree. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<HeadingLogPolarDown>);

}  // namespace wasp::vision
