#include "sim/vehicle_loop.h"

#include "rt/clock.h"
#include "shm/topics.h"

namespace wasp::sim {

VehicleLoop::VehicleLoop(const SimConfig& config, TimeNs start_ns, CompanionLine& line, const shm::Region& truth_region,
                         PoseQueue& poses, CompanionLine* second)
    : simulator_(config, start_ns),
      next_ns_(start_ns + kControlPeriod_ns),
      line_(line),
      second_(second),
      truth_(truth_region, shm::kTruth, "Truth"),
      poses_(poses) {
  output_.reserve(64 * 1024);
}

void VehicleLoop::run(const std::atomic<bool>& stop) {
  while (!stop.load(std::memory_order_relaxed)) {
    while (next_ns_ <= rt::now()) tick();
    speak();
    if (second_ != nullptr) serve_second();
    if (line_.wait(next_ns_)) hear();
  }
}

void VehicleLoop::tick() {
  if (rt::now() - next_ns_ > kControlPeriod_ns) ++late_ticks_;
  simulator_.advance_to(next_ns_);
  truth_.write(simulator_.truth(), rt::now());
  poses_.push(simulator_.pose());
  next_ns_ += kControlPeriod_ns;
}

void VehicleLoop::hear() {
  simulator_.from_companion(line_.read(), rt::now());
  speak();
}

void VehicleLoop::speak() {
  output_.clear();
  simulator_.drain(output_);
  line_.write(output_);
}

/// Its answers are up to a tick late: who asks there does not fly by them.
void VehicleLoop::serve_second() {
  if (const auto bytes = second_->read(); !bytes.empty()) simulator_.from_second_port(bytes, rt::now());
  output_.clear();
  simulator_.drain_second_port(output_);
  second_->write(output_);
}

}  // namespace wasp::sim
