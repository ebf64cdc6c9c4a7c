// The vehicle in real time: the simulator driven along CLOCK_MONOTONIC in ticks of 5 ms on an absolute grid, the line
// served as bytes arrive, truth published at 200 Hz. After a stall it catches up tick by tick.
#pragma once

#include <atomic>
#include <vector>

#include "rt/spsc_queue.h"
#include "shm/broadcast_ring.h"
#include "sim/companion_line.h"
#include "sim/pose.h"
#include "sim/simulator.h"

namespace wasp::sim {

/// Poses from the vehicle thread to the camera thread; full when there is no camera, which hurts nobody.
using PoseQueue = rt::SpscQueue<BodyPose, 256>;

class VehicleLoop {
 public:
  /// `second`: the autopilot's second port, may be nullptr.
  VehicleLoop(const SimConfig& config, TimeNs start_ns, CompanionLine& line, const shm::Region& truth_region,
              PoseQueue& poses, CompanionLine* second = nullptr);

  /// Runs until `stop`. Call from one thread.
  void run(const std::atomic<bool>& stop);
  [[nodiscard]] std::uint64_t late_ticks() const { return late_ticks_; }  ///< ticks that ran over one period late

 private:
  void tick();
  void hear();
  void speak();
  void serve_second();

  Simulator simulator_;
  TimeNs next_ns_;
  CompanionLine& line_;
  CompanionLine* second_;
  shm::RingWriter truth_;
  PoseQueue& poses_;
  std::vector<std::uint8_t> output_;
  std::uint64_t late_ticks_ = 0;
};

}  // namespace wasp::sim
