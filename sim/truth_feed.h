// The vehicle's poses for a camera in a process of its own: read from the truth ring that another wasp-sim writes.
#pragma once

#include <atomic>
#include <string>

#include "shm/broadcast_ring.h"
#include "sim/vehicle_loop.h"
#include "types/messages.h"

namespace wasp::sim {

/// The pose a camera needs of what the simulator publishes.
BodyPose pose_of(const Truth& truth);

class TruthFeed {
 public:
  /// Waits for wasp.<instance>.truth. Throws std::runtime_error after `patience_s`.
  TruthFeed(const std::string& instance, double patience_s);
  /// Moves every pose into the queue as it is published, until `stop`. Call from one thread.
  void run(PoseQueue& poses, const std::atomic<bool>& stop);

 private:
  shm::Region region_;
  shm::RingReader truth_;
};

}  // namespace wasp::sim
