// The thread that hears where the followed vehicle is: on a line of its own to the autopilot, or in the rings of a
// running flight. A line that is lost is opened again; a flight that ends is waited for.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "sim/followed_pose.h"
#include "sim/pose_link.h"

namespace wasp::sim {

class PoseFeed {
 public:
  virtual ~PoseFeed() = default;
  /// Until `stop`. Call from one thread.
  virtual void run(const std::atomic<bool>& stop) = 0;
};

/// `source`: an endpoint (drivers/endpoint.h), or "flight": the rings of the flight `instance`. Throws
/// std::runtime_error for a text that is neither.
std::unique_ptr<PoseFeed> make_pose_feed(const std::string& source, const std::string& instance,
                                         const PoseLinkParams& params, FollowedPose& pose);

}  // namespace wasp::sim
