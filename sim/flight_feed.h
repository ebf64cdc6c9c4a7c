// Where the vehicle is, from a running flight: its rings of attitudes and positions, whose times are ours already.
#pragma once

#include <memory>
#include <string>

#include "sim/pose_feed.h"

namespace wasp::sim {

/// Waits for wasp.<instance>.flight when it runs, as often as it comes.
std::unique_ptr<PoseFeed> make_flight_feed(const std::string& instance, FollowedPose& pose);

}  // namespace wasp::sim
