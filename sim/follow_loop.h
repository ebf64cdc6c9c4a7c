// The cameras of a vehicle that somebody else flies. An exposure is drawn a fixed while after its instant, when the
// poses on both sides of it are known, and stamped with that instant: late, but true. Where the pose is not known
// nothing is shown, and said so.
#pragma once

#include <atomic>
#include <optional>

#include "sim/camera_loop.h"
#include "sim/followed_pose.h"

namespace wasp::sim {

class FollowLoop {
 public:
  FollowLoop(CameraView front, std::optional<CameraView> down, TimeNs start_ns, const shm::Region& camera_region,
             FollowedPose& pose);

  /// Runs until `stop`. Call from one thread.
  void run(const std::atomic<bool>& stop);
  [[nodiscard]] const CameraEye& front() const { return front_.eye; }
  /// nullptr: there is none.
  [[nodiscard]] const CameraEye* down() const { return down_ ? &down_->eye : nullptr; }

 private:
  struct Exposures {
    Exposures(CameraView view, TimeNs start_ns, const shm::Region& region, const char* gray, const char* depth);
    CameraEye eye;
    DurationNs period_ns;
    TimeNs next_ns;
    std::uint32_t sequence = 0;

    void pass(std::uint32_t n);
  };
  void expose(Exposures& camera, const std::atomic<bool>& stop);
  std::optional<BodyPose> wait_for_pose(TimeNs exposure_ns, const std::atomic<bool>& stop);
  void tell(TimeNs exposure_ns, bool known);
  void tell_delay(DurationNs delay_ns);

  Exposures front_;
  std::optional<Exposures> down_;
  FollowedPose& pose_;
  TimeNs shown_until_ns_;  ///< the last exposure whose pose was known
  bool blind_ = false, shown_ = false;
  DurationNs told_delay_ns_ = 0;
};

}  // namespace wasp::sim
