#include "scheduling/recorded_motion.h"

namespace wasp::scheduling {

BehaviourScript script_of(const drivers::Recording& recording) {
  BehaviourScript script;
  const Mat3& R_body_cam = recording.geometry().R_body_cam;
  TimeNs before_ns = kNever;
  bool any = false;
  for (const drivers::RecordingEntry& entry : recording.entries()) {
    ScriptedStep step;
    step.frame_sequence = entry.sequence;
    step.exposed_at_ns = recording.time_ns(entry);
    const auto attitude = drivers::attitude_of(recording.motion(), R_body_cam, step.exposed_at_ns);
    step.attitude_valid = attitude.has_value();
    step.attitude = attitude.value_or(AttitudeSample{});
    any = any || step.attitude_valid;
    if (before_ns != kNever) {
      const auto force = drivers::mean_specific_force(recording.motion(), R_body_cam, before_ns, step.exposed_at_ns);
      step.accel_valid = force.has_value();
      step.accel_body_mps2 = force.value_or(std::array<float, 3>{});
    }
    before_ns = step.exposed_at_ns;
    script.push_back(step);
  }
  return any ? script : BehaviourScript{};
}

}  // namespace wasp::scheduling
