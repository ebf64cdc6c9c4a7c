// The kinds of cameras this build has.
#include <array>

#include "drivers/camera_driver.h"
#if WASP_HAVE_DC1394
#include "drivers/dc1394_camera.h"
#endif
#include "drivers/kinect_camera.h"
#include "drivers/v4l2_camera.h"

namespace wasp::drivers {

std::span<const CameraDriverRow> camera_drivers() {
  static constexpr std::array kRows {
    CameraDriverRow{"v4l2", "cameras of the kernel's Video4Linux2, USB ones above all", false, make_v4l2_camera,
                    list_v4l2_cameras},
#ifdef WASP_HAVE_FREENECT
        CameraDriverRow{"kinect", "first-generation Kinects, through libfreenect", true, make_kinect_camera,
                        list_kinect_cameras},
#endif
#if WASP_HAVE_DC1394
        CameraDriverRow{"dc1394", "IIDC cameras on IEEE 1394 or USB, through libdc1394", false, make_dc1394_camera,
                        list_dc1394_cameras},
#endif
  };
  return kRows;
}

const CameraDriverRow& camera_driver(const std::string& name) {
  std::string known;
  for (const auto& row : camera_drivers()) {
    if (row.name == name) return row;
    known += (known.empty() ? "" : ", ") + std::string(row.name);
  }
  throw std::runtime_error("this build has no camera driver '" + name + "'; it has: " + known);
}

}  // namespace wasp::drivers
