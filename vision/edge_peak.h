// Behaviour: a climb rate from the row of most edges (thesis section 7.4). Straw's flies rise or sink until the
// strongest horizontal edge lies where they expect it; over a town of boxes that carries them over every roof.
//
// The thesis sends the autopilot h = k_p Delta + k_i int Delta dt (7.40). Its rate is dh/dt = k_i Delta + k_p
// dDelta/dt. m_p jumps as edges come and go, so the second term is a train of impulses; what makes the craft settle
// with Delta = 0 is the first. This behaviour wishes climb = k_i Delta, limited, and leaves the integral to the height
// controller; so there is nothing to wind up. Delta is an angle, between the row's angle below the horizon and the
// setpoint's, so that neither the vehicle's pitch nor the lens changes what it means.
#pragma once

#include <optional>
#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/edge_rows.h"
#include "vision/kernels/emd_grid.h"
#include "vision/kernels/peak_row.h"

namespace wasp::vision {

/// Which edges count.
enum class EdgePeakMode : int {
  kAll = 0,     ///< "maximum peak": all
  kNear = 1,    ///< "maximum near-peak": those nearer than max_depth_m; without a depth reading an edge is far
  kSharp = 2,   ///< the same by a lens that is out of focus far away: those of a gradient above sharp_threshold
  kMoving = 3,  ///< where vertical motion detectors fire (8.1.3): near edges are fast ones; a still image has none
};

struct EdgePeak {
  static constexpr std::string_view kName = "edge_peak";
  static constexpr DurationNs kBudgetNs = 3 * kMillisecond;
  static constexpr Stream kStream = Stream::kGrayDepth;

  /// Index into CueBody::detail. kPeakShare: the smoothed count at m_p over the largest one.
  enum Detail { kPeakRow_px, kSetpointRow_px, kDelta_px, kDelta_rad, kEdges, kPeakShare, kThreshold, kPeakCount };

  struct Params {
    CameraGeometry camera;
    int mode = 1;                  ///< EdgePeakMode
    float max_depth_m = 3.f;       ///< D_max of (7.41)
    int min_threshold = 24;        ///< Sobel units: least gradient of an edge, modes 0 and 1
    int fixed_threshold = 40;      ///< Sobel units: gradient of an edge in modes 0 and 1; 0: the RMS, as (7.33). A
                                   ///< plain wall close by has weak edges only, and the skyline sets the RMS
    int sharp_threshold = 160;     ///< Sobel units: gradient of an edge in mode 2
    int emd_pitch_px = 4;          ///< between the motion detectors' receptors, mode 3
    float emd_min_response = 4.f;  ///< least response of one that fires [grey^2], mode 3
    float setpoint_rad = 0.f;   ///< of m_s below the horizon; 0: half-way down the lower half of a level camera's image
    float share = 0.1f;         ///< m_p is the topmost row with this share of the largest count; 1: the thesis' arg max
    int window_rows = 9;        ///< of the sliding mean
    float centre_share = 0.6f;  ///< of the image's width, about its middle: what lies beside the way is left out
    int min_edges = 60;         ///< fewer edge pixels (mode 3: detectors): nothing is near
    float gain_mps_rad = 4.f;   ///< climb rate for one radian of Delta, k_i
    float max_climb_mps = 1.f, max_sink_mps = 0.2f;
    float idle_sink_mps = 0.4f;  ///< sinks so where nothing is near
    float release_s = 1.f;       ///< a wish to climb fades no faster than with this time constant
    float hold_s = 1.5f;         ///< after the last near edge it does not sink for this long
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("mode", p.mode, 0, 3);
    visit("max_depth_m", p.max_depth_m, 0.1, 60.0);
    visit("min_threshold", p.min_threshold, 1, 1020);
    visit("sharp_threshold", p.sharp_threshold, 1, 1020);
    visit("emd_pitch_px", p.emd_pitch_px, 2, 16);
    visit("emd_min_response", p.emd_min_response, 0.0, 10000.0);
    visit("setpoint_rad", p.setpoint_rad, 0.0, 1.5);
    visit("share", p.share, 0.05, 1.0);
    visit("window_rows", p.window_rows, 1, 101);
    visit("centre_share", p.centre_share, 0.1, 1.0);
    visit("min_edges", p.min_edges, 1, 1000000);
    visit("gain_mps_rad", p.gain_mps_rad, 0.0, 20.0);
    visit("max_climb_mps", p.max_climb_mps, 0.0, 5.0);
    visit("max_sink_mps", p.max_sink_mps, 0.0, 5.0);
    visit("idle_sink_mps", p.idle_sink_mps, 0.0, 2.0);
    visit("release_s", p.release_s, 0.0, 10.0);
    visit("fixed_threshold", p.fixed_threshold, 0, 1020);
    visit("hold_s", p.hold_s, 0.0, 10.0);
  }

  /// The motion detectors (mode 3 only, empty when the image is too small for them) and when it last wished to climb.
  struct State {
    explicit State(const Params& params);
    std::optional<EmdGrid> emd;
    EmdRows fired;
    EdgeRows rows;
    TimeNs wished_at_ns = kNever, near_at_ns = kNever;
    float climb_mps = 0;
  };

  /// climb_mps: wish, positive up. quality: 1, and 0.5 where nothing is near. Blind for an image of the wrong size, in
  /// mode 1 without its depth image, in mode 3 before the second frame. Without attitude the camera is taken as level
  /// on its mount. detail: m_p, m_s [px, rows from the top], Delta = m_s - m_p, Delta as an angle, edges counted,
  /// share, threshold, mean count at m_p. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<EdgePeak>);

}  // namespace wasp::vision
