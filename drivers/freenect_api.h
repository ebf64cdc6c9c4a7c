// libfreenect, loaded when a Kinect is first asked for: a camera process without one needs no library, and fakenect
// (LD_LIBRARY_PATH), which lacks some of its functions, can stand in. Tests fill the table themselves.
#pragma once

#include <libfreenect.h>

namespace wasp::drivers {

/// Pointers of the names in libfreenect.h without their prefix. Those of the second group may be null.
struct FreenectApi {
  decltype(&::freenect_init) init = nullptr;
  decltype(&::freenect_shutdown) shutdown = nullptr;
  decltype(&::freenect_set_log_level) set_log_level = nullptr;
  decltype(&::freenect_set_log_callback) set_log_callback = nullptr;
  decltype(&::freenect_select_subdevices) select_subdevices = nullptr;
  decltype(&::freenect_num_devices) num_devices = nullptr;
  decltype(&::freenect_open_device) open_device = nullptr;
  decltype(&::freenect_open_device_by_camera_serial) open_device_by_camera_serial = nullptr;
  decltype(&::freenect_close_device) close_device = nullptr;
  decltype(&::freenect_set_depth_callback) set_depth_callback = nullptr;
  decltype(&::freenect_set_video_callback) set_video_callback = nullptr;
  decltype(&::freenect_set_depth_buffer) set_depth_buffer = nullptr;
  decltype(&::freenect_set_video_buffer) set_video_buffer = nullptr;
  decltype(&::freenect_get_depth_mode_count) get_depth_mode_count = nullptr;
  decltype(&::freenect_get_depth_mode) get_depth_mode = nullptr;
  decltype(&::freenect_get_video_mode_count) get_video_mode_count = nullptr;
  decltype(&::freenect_get_video_mode) get_video_mode = nullptr;
  decltype(&::freenect_set_depth_mode) set_depth_mode = nullptr;
  decltype(&::freenect_set_video_mode) set_video_mode = nullptr;
  decltype(&::freenect_start_depth) start_depth = nullptr;
  decltype(&::freenect_start_video) start_video = nullptr;
  decltype(&::freenect_stop_depth) stop_depth = nullptr;
  decltype(&::freenect_stop_video) stop_video = nullptr;
  decltype(&::freenect_process_events_timeout) process_events_timeout = nullptr;

  decltype(&::freenect_list_device_attributes) list_device_attributes = nullptr;
  decltype(&::freenect_free_device_attributes) free_device_attributes = nullptr;
  decltype(&::freenect_set_flag) set_flag = nullptr;
  decltype(&::freenect_set_ir_brightness) set_ir_brightness = nullptr;
};

/// The library's. Throws CameraError naming the library, or the function it lacks.
const FreenectApi& freenect_library();

}  // namespace wasp::drivers
