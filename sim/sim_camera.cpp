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
      optics_(setup.optics),
      renderer_(std::move(scene), setup.geometry.lens(), setup.optics.field_of_view_rad),
      sensor_(sensor, setup.geometry.intrinsics.width_px, setup.geometry.intrinsics.fx_px, seed),
      frame_(renderer_.frame()),
      depth_m_(static_cast<std::size_t>(renderer_.width_px())) {
  const OpticsParams& o = setup.optics;
  if (o.exposure_s > 0) exposure_.emplace(geometry_, o.exposure_s, o.antialias, renderer_);
  if (o.aperture_m > 0) defocus_.emplace(o, geometry_.intrinsics.fx_px, renderer_.width_px(), renderer_.height_px());
}

CameraPose SimCamera::camera_pose(const BodyPose& pose) const { return camera_pose_of(pose, geometry_); }

void SimCamera::render(const BodyPose& pose, std::uint32_t frame, std::uint8_t* gray, std::uint16_t* depth_mm,
                       const std::function<void()>& almost_done) {
  const CameraPose camera = camera_pose(pose);
  const WorldScene::Moment moment = renderer_.scene().at(pose.flight_time_s);
  renderer_.cast(camera, frame_);
  if (optics_.antialias) renderer_.antialias(camera, frame_);
  if (exposure_) exposure_->apply(renderer_, pose, frame_);
  if (defocus_) defocus_->apply(frame_);
  const auto width = static_cast<std::size_t>(renderer_.width_px());
  for (int row = 0; row < renderer_.height_px(); ++row) {
    const std::size_t at = static_cast<std::size_t>(row) * width;
    if (almost_done && row == renderer_.height_px() - kLastRows) almost_done();
    sensor_.gray_row(frame, row, frame_.luminance.data() + at, gray + at);
    if (depth_mm == nullptr) continue;
    renderer_.depth_row(row, frame_.range.data() + at, depth_m_.data());
    sensor_.depth_row(frame, row, depth_m_.data(), depth_mm + at);
  }
}

}  // namespace wasp::sim
