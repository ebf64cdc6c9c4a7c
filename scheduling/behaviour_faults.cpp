#include "scheduling/behaviour_faults.h"

#include <limits>

#include "scheduling/busy_wait.h"

namespace wasp::scheduling {
namespace {

/// Every number a cue may carry; what it has (has_height ...) stays as the behaviour said.
void fill_numbers(CueBody& body, float value) WASP_REALTIME {
  for (float* number : {&body.quality, &body.height_m, &body.height_sigma_m, &body.heading_rate_radps, &body.pitch_rad,
                        &body.velocity_forward_mps, &body.velocity_right_mps, &body.velocity_sigma_mps, &body.climb_mps,
                        &body.climb_1ps})
    *number = value;
  body.detail.fill(value);
}

}  // namespace

bool BehaviourFaults::on(FaultPoint point) const WASP_REALTIME {
  return control_->faults->on(point, rt::now(), target_);
}

void BehaviourFaults::corrupt(BehaviourInput& input) const WASP_REALTIME {
  if (!on(FaultPoint::kBehaviourDenormal)) return;
  const float value = control_->faults->value(FaultPoint::kBehaviourDenormal) >= 0.5f
                          ? std::numeric_limits<float>::quiet_NaN()
                          : std::numeric_limits<float>::denorm_min();
  input.attitude.q_ned_body.fill(value);
  input.attitude.rate_body_radps.fill(value);
  input.accel_body_mps2.fill(value);
}

void BehaviourFaults::be_busy() const WASP_REALTIME {
  const FaultBoard& board = *control_->faults;
  if (on(FaultPoint::kBehaviourSpin)) be_busy_for(milliseconds_of(board, FaultPoint::kBehaviourSpin), *control_);
  while (on(FaultPoint::kBehaviourEndless) && !control_->stop.load(std::memory_order_relaxed)) {
  }
}

void BehaviourFaults::corrupt(CueBody& body) WASP_REALTIME {
  be_busy();
  if (on(FaultPoint::kBehaviourNanCue)) fill_numbers(body, std::numeric_limits<float>::quiet_NaN());
  if (on(FaultPoint::kBehaviourHugeCue)) fill_numbers(body, control_->faults->value(FaultPoint::kBehaviourHugeCue));
  const bool stuck = on(FaultPoint::kBehaviourStuckCue);
  if (stuck && !is_stuck_) stuck_ = body;
  if (stuck) body = stuck_;
  is_stuck_ = stuck;
}

TimeNs BehaviourFaults::shifted(TimeNs exposed_at_ns) const WASP_REALTIME {
  if (!on(FaultPoint::kBehaviourFutureCue)) return exposed_at_ns;
  return exposed_at_ns + milliseconds_of(*control_->faults, FaultPoint::kBehaviourFutureCue);
}

}  // namespace wasp::scheduling
