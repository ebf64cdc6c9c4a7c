#include "sim/sim_camera.h"

#include <utility>

#include "sim/random.h"
#include "sim/vrml_file.h"

namespace wasp::sim {
namespace {

World world_of(const SimConfig& config) {
  return placed_at_start(config.world_file.empty() ? generated_scene(config) : read_vrml(config.world_file));
}

}  // namespace

std::shared_ptr<WorldScene> make_world_scene(const SimConfig& config) {
  return std::make_shared<WorldScene>(world_of(config));
}

std::uint32_t down_seed(std::uint32_t seed) { return mix(seed, 0xd0); }

SimCamera::SimCamera(const SimConfig& config)
    : SimCamera(make_world_scene(config), config.front(), config.sensor, config.seed) {}

SimCamera::SimCamera(std::shared_ptr<const WorldScene> scene, const CameraSetup& setup, const SensorParams& sensor,
                     std::uint32_t seed)
    : geometry_(setup.geometry),
      renderer_(std::move(scene), setup.geometry.intrinsics),
      sensor_(sensor, setup.geometry.intrinsics.width_px, setup.geometry.intrinsics.fx_px, seed),
      luminance_(static_cast<std::size_t>(renderer_.width_px()) * Renderer::kBandRows),
      depth_m_(luminance_.size()) {}

CameraPose SimCamera::camera_pose(const BodyPose& pose) const {
  return {pose.position_ned_m + pose.q_ned_body * geometry_.position_body_m,
          pose.q_ned_body.toRotationMatrix() * geometry_.R_body_cam};
}

void SimCamera::render(const BodyPose& pose, std::uint32_t frame, std::uint8_t* gray, std::uint16_t* depth_mm,
                       const std::function<void()>& almost_done) {
  const CameraPose camera = camera_pose(pose);
  const auto width = static_cast<std::size_t>(renderer_.width_px());
  for (int band = 0; band < renderer_.height_px(); band += Renderer::kBandRows) {
    renderer_.render_band(camera, band, luminance_.data(), depth_m_.data());
    for (int i = 0; i < Renderer::kBandRows; ++i) {
      const std::size_t from = static_cast<std::size_t>(i) * width, to = static_cast<std::size_t>(band + i) * width;
      if (almost_done && band + i == renderer_.height_px() - kLastRows) almost_done();
      sensor_.gray_row(frame, band + i, luminance_.data() + from, gray + to);
      if (depth_mm != nullptr) sensor_.depth_row(frame, band + i, depth_m_.data() + from, depth_mm + to);
    }
  }
}

}  // namespace wasp::sim
