// A simulated camera: world, renderer and sensor model behind one call. The front one is a Kinect and gives depth too.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "sim/defocus.h"
#include "sim/exposure.h"
#include "sim/pose.h"
#include "sim/renderer.h"
#include "sim/sensor_model.h"
#include "sim/sim_config.h"

namespace wasp::sim {

/// Builds the laboratory, which takes about a second, or reads the world file. Throws as read_vrml does.
std::shared_ptr<WorldScene> make_world_scene(const SimConfig& config);

/// The downward camera's seed for a run's seed.
std::uint32_t down_seed(std::uint32_t seed);

class SimCamera {
 public:
  /// The front camera in a world of its own.
  explicit SimCamera(const SimConfig& config);
  /// A camera in a world that others may see too. `seed` numbers the sensor's noise: one of its own for each camera.
  /// Throws std::runtime_error for sizes the renderer refuses.
  SimCamera(std::shared_ptr<const WorldScene> scene, const CameraSetup& setup, const SensorParams& sensor,
            std::uint32_t seed);

  /// Both images of the exposure whose middle is `pose`: mono8 and depth uint16 mm (0 = no reading; depth_mm may be
  /// nullptr), row-major, no padding, width_px x height_px. During an exposure (optics.exposure_s) the vehicle moves on
  /// with the pose's velocity and rate; depth is that of its middle. `frame` numbers the noise. `almost_done`, if
  /// given, is called kLastRows rows before the end. One thread at a time. Allocates nothing.
  void render(const BodyPose& pose, std::uint32_t frame, std::uint8_t* gray, std::uint16_t* depth_mm,
              const std::function<void()>& almost_done = {});
  static constexpr int kLastRows = 4;  ///< some 10 to 40 us; a sleeping reader wakes up in about 10

  [[nodiscard]] CameraPose camera_pose(const BodyPose& pose) const;
  /// The image before the sensor, as the last render left it.
  [[nodiscard]] const CastFrame& ideal() const { return frame_; }
  [[nodiscard]] const Renderer& renderer() const { return renderer_; }
  [[nodiscard]] int width_px() const { return renderer_.width_px(); }
  [[nodiscard]] int height_px() const { return renderer_.height_px(); }

 private:
  CameraGeometry geometry_;
  OpticsParams optics_;
  Renderer renderer_;
  SensorModel sensor_;
  CastFrame frame_;
  std::optional<Exposure> exposure_;  ///< with an open shutter
  std::optional<Defocus> defocus_;    ///< with an aperture
  std::vector<float> depth_m_;        ///< one row
};

}  // namespace wasp::sim
