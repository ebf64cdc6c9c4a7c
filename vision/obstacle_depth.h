// Behaviour: the fine process of the balance strategy (thesis 6.1): round single things that stand, or walk, in the
// way. Two forms of it:
//  - kFreePath (default): ranges of the cells, from the depth camera or from flow, go into a map around the vehicle
//    (kernels/obstacle_map.h); where the straight path is not free, the best turn is found by flying ahead
//    (kernels/free_path.h). Things that come nearer faster than the vehicle flies are taken to go on doing so.
//  - kPrinted: depth by (6.11), k-means (6.12), the force away from the clusters (6.13, 6.14), as the thesis has it.
// Both forces of (6.15) are in detail[] in either form, for fig. 6.8.
//
// The behaviour is given no velocity. With a depth camera it measures its own: a thing at a known distance whose
// direction changes so fast is passed at that speed; the median of all cells. Without one `speed_mps` is believed, so
// that ranges are times to contact in disguise: a wrong speed scales all of them alike.
#pragma once

#include <string_view>

#include "types/behaviour.h"
#include "types/camera.h"
#include "types/realtime.h"
#include "vision/kernels/balance_template.h"
#include "vision/kernels/cluster.h"
#include "vision/kernels/flow_depth.h"
#include "vision/kernels/free_path.h"
#include "vision/kernels/obstacle_map.h"

namespace wasp::vision {

struct ObstacleDepth {
  static constexpr std::string_view kName = "obstacle_depth";
  static constexpr DurationNs kBudgetNs = 3 * kMillisecond;
  static constexpr Stream kStream = Stream::kFlow;

  /// Index into CueBody::detail. kGross_px and kFine: x of the thesis' two forces, right positive.
  enum Detail { kGross_px, kFine, kObstacles, kClearance_m, kStraightClearance_m, kSpeed_mps, kFirst_rad, kNearest_m };

  struct Params {
    CameraGeometry camera;
    int printed = 0;               ///< 1: the thesis' force steers
    int use_depth_camera = 1;      ///< 0: ranges by flow alone
    float speed_mps = 0.8f;        ///< believed while it is not measured
    float least_speed_mps = 0.1f;  ///< slower than this the vehicle hovers: nothing is in its way
    float brake_rad = 0.1f;        ///< nose up when no way is free
    MapParams map;
    PathParams path;
    FlowDepthParams flow_depth{.flow_sigma_px = 0.1f};
    ClusterParams cluster;
    FineParams fine;
    float fine_gain = 2e-6f;  ///< rad/s over the printed fine force
  };

  /// What a configuration may set: visit(key, field, least, greatest).
  template <class Visitor>
  static void visit_params(Params& p, Visitor&& visit) {
    visit("printed", p.printed, 0, 1);
    visit("use_depth_camera", p.use_depth_camera, 0, 1);
    visit("speed_mps", p.speed_mps, 0.05, 10.0);
    visit("least_speed_mps", p.least_speed_mps, 0.0, 5.0);
    visit("brake_rad", p.brake_rad, 0.0, 0.35);
    visit("above_m", p.map.above_m, 0.05, 5.0);
    visit("below_m", p.map.below_m, 0.05, 5.0);
    visit("max_range_m", p.map.max_range_m, 0.5, 50.0);
    visit("memory_s", p.map.memory_s, 0.0, 20.0);
    visit("half_width_m", p.path.half_width_m, 0.05, 3.0);
    visit("margin_m", p.path.margin_m, 0.0, 3.0);
    visit("comfort_m", p.path.comfort_m, 0.05, 3.0);
    visit("delay_s", p.path.delay_s, 0.0, 1.0);
    visit("yaw_lag_s", p.path.yaw_lag_s, 0.02, 2.0);
    visit("drift_s", p.path.drift_s, 0.02, 5.0);
    visit("max_rate_radps", p.path.max_rate_radps, 0.05, 2.0);
    visit("max_depth_m", p.fine.max_depth_m, 0.5, 50.0);
    visit("fine_gain", p.fine_gain, 0.0, 1.0);
  }

  struct State {
    TimeNs last_ns = 0;
    bool started = false;
    float speed_mps = -1.f;  ///< measured, filtered; < 0: not yet
    float travel_rad = 0;    ///< direction of travel from the heading, modelled
    float first_rad = 0;     ///< heading of the last plan
    ObstacleMap map;
    ForceAverage gross;
  };

  /// heading_rate_radps: 0 while the way is free, else the turn around what is in it; pitch_rad > 0 where no way is
  /// free. Blind without a de-rotated field or with ranges of fewer than four cells. quality: cells with a range, 1
  /// from 60 on. Survives any input. Realtime-safe: yes.
  static CueBody step(const Params& params, const BehaviourInput& input, State& state) WASP_REALTIME;
};

static_assert(Behaviour<ObstacleDepth>);

}  // namespace wasp::vision
