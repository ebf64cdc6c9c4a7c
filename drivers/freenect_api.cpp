#include "drivers/freenect_api.h"

#include <dlfcn.h>

#include <string>

#include "drivers/camera_driver.h"

namespace wasp::drivers {
namespace {

constexpr const char* kLibrary = "libfreenect.so.0.5";

void* load() {
  void* library = dlopen(kLibrary, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) throw CameraError("kinect", dlerror(), "install the package libfreenect0.5");
  return library;
}

struct Loader {
  void* library;

  template <class Function>
  void optional(Function& function, const char* name) const {
    function = reinterpret_cast<Function>(dlsym(library, (std::string("freenect_") + name).c_str()));
  }
  template <class Function>
  void required(Function& function, const char* name) const {
    optional(function, name);
    if (function == nullptr) throw CameraError("kinect", std::string(kLibrary) + " has no freenect_" + name);
  }
};

FreenectApi fill() {
  const Loader loader{load()};
  FreenectApi api;
  loader.required(api.init, "init");
  loader.required(api.shutdown, "shutdown");
  loader.required(api.set_log_level, "set_log_level");
  loader.required(api.set_log_callback, "set_log_callback");
  loader.required(api.select_subdevices, "select_subdevices");
  loader.required(api.num_devices, "num_devices");
  loader.required(api.open_device, "open_device");
  loader.required(api.open_device_by_camera_serial, "open_device_by_camera_serial");
  loader.required(api.close_device, "close_device");
  loader.required(api.set_depth_callback, "set_depth_callback");
  loader.required(api.set_video_callback, "set_video_callback");
  loader.required(api.set_depth_buffer, "set_depth_buffer");
  loader.required(api.set_video_buffer, "set_video_buffer");
  loader.required(api.get_depth_mode_count, "get_depth_mode_count");
  loader.required(api.get_depth_mode, "get_depth_mode");
  loader.required(api.get_video_mode_count, "get_video_mode_count");
  loader.required(api.get_video_mode, "get_video_mode");
  loader.required(api.set_depth_mode, "set_depth_mode");
  loader.required(api.set_video_mode, "set_video_mode");
  loader.required(api.start_depth, "start_depth");
  loader.required(api.start_video, "start_video");
  loader.required(api.stop_depth, "stop_depth");
  loader.required(api.stop_video, "stop_video");
  loader.required(api.process_events_timeout, "process_events_timeout");
  loader.optional(api.list_device_attributes, "list_device_attributes");
  loader.optional(api.free_device_attributes, "free_device_attributes");
  loader.optional(api.set_flag, "set_flag");
  loader.optional(api.set_ir_brightness, "set_ir_brightness");
  return api;
}

}  // namespace

const FreenectApi& freenect_library() {
  static const FreenectApi api = fill();
  return api;
}

}  // namespace wasp::drivers
