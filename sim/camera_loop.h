// The camera in real time: exposures on an absolute grid; the pose at the exposure's instant is interpolated between
// the vehicle's ticks; both images are rendered straight into loaned ring slots and published with the same sequence.
#pragma once

#include <atomic>

#include "rt/histogram.h"
#include "rt/periodic.h"
#include "shm/broadcast_ring.h"
#include "sim/sim_camera.h"
#include "sim/vehicle_loop.h"

namespace wasp::sim {

class CameraLoop {
 public:
  CameraLoop(SimCamera& camera, TimeNs start_ns, double rate_hz, const shm::Region& camera_region, PoseQueue& poses);

  /// Runs until `stop`. Call from one thread.
  void run(const std::atomic<bool>& stop);
  [[nodiscard]] std::uint64_t frames() const { return gray_.published(); }
  [[nodiscard]] std::uint64_t skipped() const {
    return skipped_;
  }  ///< exposures missed because rendering took too long
  [[nodiscard]] const rt::Histogram& render_time() const { return render_time_; }
  /// From the announcement of a frame to its publication.
  [[nodiscard]] const rt::Histogram& lead() const { return lead_; }

  /// Topics of a camera region with frames of this size.
  static std::vector<shm::TopicSpec> topics(int width_px, int height_px);

 private:
  bool pose_at(TimeNs exposure_ns, const std::atomic<bool>& stop, BodyPose& pose);
  void publish(const BodyPose& pose, std::uint32_t sequence);

  SimCamera& camera_;
  rt::PeriodicGrid grid_;
  shm::RingWriter gray_, depth_;
  PoseQueue& poses_;
  BodyPose before_, after_;
  rt::Histogram render_time_, lead_;
  TimeNs announced_at_ns_ = 0;
  std::uint64_t skipped_ = 0;
};

}  // namespace wasp::sim
