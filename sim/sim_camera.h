// The simulated Kinect: world, renderer and sensor model behind one call.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "sim/pose.h"
#include "sim/renderer.h"
#include "sim/sensor_model.h"
#include "sim/sim_config.h"

namespace wasp::sim {

class SimCamera {
 public:
  /// Builds the laboratory, which takes about a second, or reads the world file. Throws as read_vrml does.
  explicit SimCamera(const SimConfig& config);

  /// Both images of one exposure at a body pose: mono8 and depth uint16 mm (0 = no reading), row-major, no padding,
  /// width_px x height_px. `frame` numbers the noise. `almost_done`, if given, is called kLastRows rows before the end.
  /// One thread at a time. Allocates nothing.
  void render(const BodyPose& pose, std::uint32_t frame, std::uint8_t* gray, std::uint16_t* depth_mm,
              const std::function<void()>& almost_done = {});
  static constexpr int kLastRows = 4;  ///< some 10 to 40 us; a sleeping reader wakes up in about 10

  [[nodiscard]] CameraPose camera_pose(const BodyPose& pose) const;
  [[nodiscard]] const Renderer& renderer() const { return renderer_; }
  [[nodiscard]] int width_px() const { return renderer_.width_px(); }
  [[nodiscard]] int height_px() const { return renderer_.height_px(); }

 private:
  CameraGeometry geometry_;
  Renderer renderer_;
  SensorModel sensor_;
  std::vector<float> luminance_, depth_m_;
};

}  // namespace wasp::sim
