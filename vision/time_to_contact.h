// Behaviour: time to contact with what lies ahead, and the avoid command (thesis section 5.4). Cells of the flow
// without the camera's turn are seen as by a level camera that looks along the heading; the focus of expansion (foe.h)
// says where the vehicle flies to. Only cells within `ahead_angle_rad` of it count: at the distance where a wall must
// be avoided it fills that disc, while ground, ceiling and corridor walls stand there far off. The growth of the disc,
// by a similarity fit whose shift is free, is the inverse time to contact: an error of the turn or of the focus shifts
// the disc's flow but does not grow it. The decision is the printed one (avoid_decision.h), on time instead of frame
// numbers so that a lost frame is no error, behind two gates of our own: the time to contact itself must be near, and
// the line must fall about as fast as time passes.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/avoid_decision.h"
#include "vision/kernels/camera_model.h"

namespace wasp::vision {

struct TimeToContactFront {
  static constexpr std::string_view kName = "time_to_contact";
  static constexpr DurationNs kBudgetNs = kMillisecond;
  static constexpr Stream kStream = Stream::kFlow;

  /// Index into CueBody::detail.
  enum Detail {
    kContact_frames,  ///< time to contact of this field [frames of frame_s]; 0: none, < 0: receding
    kFoeRight_rad,    ///< where the vehicle flies to, from the level heading
    kFoeDown_rad,
    kPValue,              ///< of the line through the last pairs; 1 without one
    kLineContact_frames,  ///< where the line meets zero, from now
    kSlope,               ///< of the line; -1 at constant speed
    kCells,               ///< valid ones ahead
    kInlierShare,         ///< of them that grow alike
  };

  struct Params {
    CameraGeometry camera;
    float frame_s = 1.f / 30.f;      ///< what the thesis' "frame" means [s]
    float ahead_angle_rad = 0.3f;    ///< radius of the disc about the focus of expansion (17 degrees)
    float foe_angle_rad = 1.f;       ///< cells for the focus: this near to the heading
    float max_drift_rad = 0.3f;      ///< a focus farther from the heading is not believed
    float max_foe_sigma_rad = 0.1f;  ///< nor a less certain one
    float foe_smoothing_s = 0.2f;    ///< time constant of its low pass
    float foe_memory_s = 1.f;        ///< kept this long when none is found; then the heading takes its place
    float widest_angle_rad = 0.5f;   ///< the disc grows so far while it holds fewer than `wanted_cells`
    int wanted_cells = 12;
    int min_cells = 6;              ///< ahead, that grow alike
    float min_inlier_share = 0.5f;  ///< of the cells ahead
    float significance = 3.f;       ///< growth must exceed this many sigmas
    int pairs = 5;                  ///< of the line
    float frames_ahead = 30.f;      ///< F_max
    float max_p_value = 0.05f;
    float max_contact_frames = 45.f;                   ///< gate: the last pair itself
    float least_slope = -3.f, greatest_slope = -0.3f;  ///< gate: of the line
    float hold_s = 1.f;                                ///< avoid stays raised so long after the decision
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("frame_s", p.frame_s, 0.005, 0.2);
    visit("ahead_angle_rad", p.ahead_angle_rad, 0.05, 1.0);
    visit("widest_angle_rad", p.widest_angle_rad, 0.05, 1.0);
    visit("wanted_cells", p.wanted_cells, 3, FlowField::kMaxColumns * FlowField::kMaxRows);
    visit("foe_angle_rad", p.foe_angle_rad, 0.1, 1.4);
    visit("max_drift_rad", p.max_drift_rad, 0.0, 1.0);
    visit("max_foe_sigma_rad", p.max_foe_sigma_rad, 0.001, 1.0);
    visit("foe_smoothing_s", p.foe_smoothing_s, 0.0, 5.0);
    visit("foe_memory_s", p.foe_memory_s, 0.0, 10.0);
    visit("min_cells", p.min_cells, 3, FlowField::kMaxColumns * FlowField::kMaxRows);
    visit("min_inlier_share", p.min_inlier_share, 0.1, 1.0);
    visit("significance", p.significance, 0.5, 20.0);
    visit("pairs", p.pairs, 3, kMaxAvoidPairs);
    visit("frames_ahead", p.frames_ahead, 1.0, 300.0);
    visit("max_p_value", p.max_p_value, 0.0, 1.0);
    visit("max_contact_frames", p.max_contact_frames, 1.0, 1000.0);
    visit("least_slope", p.least_slope, -100.0, 0.0);
    visit("greatest_slope", p.greatest_slope, -100.0, 0.0);
    visit("hold_s", p.hold_s, 0.0, 10.0);
  }

  /// pairs, frames_ahead and max_p_value take effect when it is made.
  struct State {
    explicit State(const Params& params) WASP_REALTIME;
    AvoidMonitor monitor;
    TimeNs last_at_ns = 0, last_pair_at_ns = 0, foe_at_ns = 0, avoided_at_ns = 0;
    bool has_last = false, has_pair = false, has_foe = false, has_avoid = false;
    Ray foe;  ///< in the level view along the heading
  };

  /// Valid when there are cells enough ahead to judge by; a valid cue without avoid means that nothing comes near.
  /// Needs the turn from attitude: without, blind. While avoid is held the flag stands in such a blind cue too.
  /// Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<TimeToContactFront>);

}  // namespace wasp::vision
