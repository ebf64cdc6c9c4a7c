// The words of the behaviour ground_flow (vision/ground_flow.h) added up from one OPTICAL_FLOW_RAD to the next. Only an
// unbroken run counts: after a blind step, or one that was lost, the sum begins anew.
#pragma once

#include <cmath>

#include "types/messages.h"
#include "types/realtime.h"
#include "vision/ground_flow.h"

namespace wasp::scheduling {

class FlowIntegral {
 public:
  /// Realtime-safe: yes.
  void add(const Cue& cue) WASP_REALTIME {
    using Flow = vision::GroundFlow;
    const auto& d = cue.body.detail;
    const bool valid = cue.body.validity == Validity::kValid && cue.over_budget == 0;
    const TimeNs from_ns = cue.exposed_at_ns - from_seconds(static_cast<double>(d[Flow::kInterval_s]));
    if (!valid || std::abs(from_ns - until_ns_) > kSlack) clear();
    if (!valid) return;
    if (steps_ == 0) from_ns_ = from_ns;
    until_ns_ = cue.exposed_at_ns;
    flow_x_rad_ += d[Flow::kFlowX_rad], flow_y_rad_ += d[Flow::kFlowY_rad];
    for (std::size_t k = 0; k < 3; ++k) turn_rad_[k] += d[Flow::kTurnX_rad + k];
    quality_ += cue.body.quality;
    slant_ = d[Flow::kSlant];
    ++steps_;
  }
  void clear() WASP_REALTIME {
    const TimeNs until_ns = until_ns_;
    *this = {};
    until_ns_ = until_ns;
  }
  /// What follows is another sum.
  void taken() WASP_REALTIME { clear(); }

  [[nodiscard]] int steps() const WASP_REALTIME { return steps_; }
  [[nodiscard]] TimeNs from_ns() const WASP_REALTIME { return from_ns_; }
  [[nodiscard]] TimeNs until_ns() const WASP_REALTIME { return until_ns_; }
  [[nodiscard]] float flow_x_rad() const WASP_REALTIME { return flow_x_rad_; }
  [[nodiscard]] float flow_y_rad() const WASP_REALTIME { return flow_y_rad_; }
  [[nodiscard]] const std::array<float, 3>& turn_rad() const WASP_REALTIME { return turn_rad_; }  ///< by attitude
  [[nodiscard]] float quality() const WASP_REALTIME { return steps_ > 0 ? quality_ / static_cast<float>(steps_) : 0; }
  [[nodiscard]] float slant() const WASP_REALTIME { return slant_; }

 private:
  static constexpr DurationNs kSlack = 2 * kMillisecond;
  int steps_ = 0;
  TimeNs from_ns_ = kNever, until_ns_ = 0;
  float flow_x_rad_ = 0, flow_y_rad_ = 0, quality_ = 0, slant_ = 1;
  std::array<float, 3> turn_rad_{};
};

}  // namespace wasp::scheduling
