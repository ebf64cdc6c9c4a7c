// In the place of camera_part.cpp where the renderer is not built.
#include <stdexcept>

#include "sim/camera_part.h"

namespace wasp::sim {

struct CameraPart::Parts {};

CameraPart::CameraPart(const SimConfig&, const std::string&) {
  throw std::runtime_error("built without the renderer (WASP_FLIGHT_ONLY): say --no-camera");
}
CameraPart::~CameraPart() = default;
void CameraPart::start(TimeNs, PoseQueue&, const std::atomic<bool>&) {}
void CameraPart::start(TimeNs, FollowedPose&, const std::atomic<bool>&) {}
void CameraPart::join() {}
std::string CameraPart::summary() const { return {}; }

}  // namespace wasp::sim
