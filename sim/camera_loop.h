// The cameras in real time: exposures on absolute grids; the pose at an exposure's instant is interpolated between the
// vehicle's ticks; images are rendered straight into loaned ring slots. The front camera publishes depth first, then
// the grey frame of the same sequence, so that who is woken by the one finds the other. A second camera, which looks
// down, is exposed half a period later by the same thread: nothing in the world moves under a camera's eyes.
#pragma once

#include <atomic>
#include <optional>

#include "rt/histogram.h"
#include "rt/periodic.h"
#include "shm/broadcast_ring.h"
#include "sim/sim_camera.h"
#include "sim/vehicle_loop.h"

namespace wasp::sim {

/// A camera and how often it is exposed.
struct CameraView {
  SimCamera* camera = nullptr;
  double rate_hz = 30;
};

/// One camera's exposures, rings and account.
class CameraEye {
 public:
  /// `depth_topic` may be nullptr: grey only.
  CameraEye(CameraView view, TimeNs start_ns, rt::OverrunPolicy policy, const shm::Region& region,
            const char* gray_topic, const char* depth_topic);

  /// Renders and publishes the exposure at `pose`.
  void publish(const BodyPose& pose, std::uint32_t sequence);
  /// Sleeps to the next exposure; those that fell due meanwhile are passed over or made late, as the policy says.
  rt::Release wait_next();
  /// When it is due, unless it is passed over.
  [[nodiscard]] TimeNs next_due_ns() const { return next_due_ns_; }

  [[nodiscard]] std::uint64_t frames() const { return gray_.published(); }
  void count_skipped(std::uint64_t n) { skipped_ += n; }
  [[nodiscard]] std::uint64_t skipped() const { return skipped_; }  ///< exposures missed: rendering took too long
  [[nodiscard]] const rt::Histogram& render_time() const { return render_time_; }
  /// From the announcement of a frame to its publication.
  [[nodiscard]] const rt::Histogram& lead() const { return lead_; }

 private:
  SimCamera& camera_;
  DurationNs period_ns_;
  rt::PeriodicGrid grid_;
  TimeNs next_due_ns_;
  shm::RingWriter gray_;
  std::optional<shm::RingWriter> depth_;
  rt::Histogram render_time_, lead_;
  TimeNs announced_at_ns_ = 0;
  std::uint64_t skipped_ = 0;
};

class CameraLoop {
 public:
  CameraLoop(CameraView front, std::optional<CameraView> down, TimeNs start_ns, const shm::Region& camera_region,
             PoseQueue& poses);

  /// Runs until `stop`. Call from one thread.
  void run(const std::atomic<bool>& stop);
  [[nodiscard]] const CameraEye& front() const { return front_; }
  /// nullptr: there is none.
  [[nodiscard]] const CameraEye* down() const { return down_ ? &*down_ : nullptr; }

  /// Topics of a camera region with frames of these cameras' sizes; `down` may be nullptr.
  static std::vector<shm::TopicSpec> topics(const SimCamera& front, const SimCamera* down);

 private:
  bool pose_at(TimeNs exposure_ns, const std::atomic<bool>& stop, BodyPose& pose);

  CameraEye front_;
  std::optional<CameraEye> down_;
  PoseQueue& poses_;
  BodyPose before_, after_;
};

}  // namespace wasp::sim
