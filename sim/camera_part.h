// The cameras of wasp-sim in one piece: the world, its renderers, the region with the frames, the thread. Built
// without the renderer (WASP_FLIGHT_ONLY) it refuses to be made: sim/camera_absent.cpp.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "sim/followed_pose.h"
#include "sim/sim_config.h"
#include "sim/vehicle_loop.h"

namespace wasp::sim {

class CameraPart {
 public:
  /// Builds the laboratory and the region; takes about a second. Throws std::runtime_error with the reason.
  CameraPart(const SimConfig& config, const std::string& instance);
  ~CameraPart();
  CameraPart(const CameraPart&) = delete;
  CameraPart& operator=(const CameraPart&) = delete;

  /// Starts the thread: exposures on a grid from `start_ns`, until `stop`.
  void start(TimeNs start_ns, PoseQueue& poses, const std::atomic<bool>& stop);
  /// The same for a vehicle that somebody else flies: exposures wait until their pose is known.
  void start(TimeNs start_ns, FollowedPose& pose, const std::atomic<bool>& stop);
  void join();
  /// After join: frames made and missed, time to render. For people.
  [[nodiscard]] std::string summary() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace wasp::sim
