#include "drivers/kinect_device.h"

#include <sys/time.h>

#include <algorithm>
#include <cstdio>
#include <cstring>

namespace wasp::drivers {
namespace {

thread_local KinectLog* listening = nullptr;

void on_log(freenect_context*, freenect_loglevel level, const char* text) {
  if (listening != nullptr) listening->hear(level, text);
}

constexpr const char* kRights = "libfreenect's udev rule lets the group plugdev in: `usermod -aG plugdev USER`";

}  // namespace

void KinectLog::hear(freenect_loglevel level, const char* text) {
  if (level <= FREENECT_LOG_ERROR) {
    last_error.assign(text);
    while (!last_error.empty() && last_error.back() == '\n') last_error.pop_back();
    return;
  }
  std::array<char, 8> kind{};
  Packets p;
  if (std::sscanf(text, "Got %7s frame of size %*d/%*d, %d/%d packets arrived", kind.data(), &p.arrived,
                  &p.expected) == 3)
    packets[std::strcmp(kind.data(), "depth") == 0 ? 0 : 1] = p;
}

std::vector<std::string> kinect_serials(const FreenectApi& api, freenect_context* context) {
  std::vector<std::string> serials;
  if (api.list_device_attributes == nullptr || api.free_device_attributes == nullptr) {
    serials.resize(static_cast<std::size_t>(std::max(0, api.num_devices(context))));
    return serials;
  }
  freenect_device_attributes* list = nullptr;
  api.list_device_attributes(context, &list);
  for (const auto* one = list; one != nullptr; one = one->next)
    serials.emplace_back(one->camera_serial == nullptr ? "" : one->camera_serial);
  api.free_device_attributes(list);
  return serials;
}

KinectDevice::KinectDevice(const FreenectApi& api, const std::string& serial) : api_(api) {
  listening = &log_;
  if (api_.init(&context_, nullptr) < 0) {
    context_ = nullptr;
    fail("libusb cannot start");
  }
  api_.set_log_callback(context_, on_log);
  api_.set_log_level(context_, FREENECT_LOG_SPEW);  // the level of "Got depth frame ...", one line an image
  api_.select_subdevices(context_, FREENECT_DEVICE_CAMERA);
  try {
    open(serial);
  } catch (...) {
    shut();
    throw;
  }
}

KinectDevice::~KinectDevice() { shut(); }

void KinectDevice::open(const std::string& serial) {
  const std::vector<std::string> found = kinect_serials(api_, context_);
  serial_ = serial;
  if (found.empty()) fail("no Kinect is plugged in", "it needs its own power supply as well");
  if (serial.empty() && found.size() > 1) {
    std::string all;
    for (const auto& one : found) all += " " + one;
    fail("several Kinects are plugged in", "set [camera] device to one of these serial numbers:" + all);
  }
  if (serial.empty()) serial_ = found.front();
  const int result = serial_.empty() ? api_.open_device(context_, &device_, 0)
                                     : api_.open_device_by_camera_serial(context_, &device_, serial_.c_str());
  if (result >= 0) return;
  device_ = nullptr;
  fail("cannot be opened", kRights);
}

void KinectDevice::shut() noexcept {
  listening = &log_;
  if (device_ != nullptr) api_.close_device(device_);
  if (context_ != nullptr) api_.shutdown(context_);
  device_ = nullptr;
  context_ = nullptr;
  listening = nullptr;
}

freenect_frame_mode KinectDevice::set_depth(freenect_depth_format format, const char* name) {
  for (int i = 0; i < api_.get_depth_mode_count(); ++i) {
    const freenect_frame_mode mode = api_.get_depth_mode(i);
    if (mode.is_valid == 0 || mode.resolution != FREENECT_RESOLUTION_MEDIUM || mode.depth_format != format) continue;
    if (api_.set_depth_mode(device_, mode) < 0) fail(std::string("does not take depth_mode \"") + name + '"');
    return mode;
  }
  fail(std::string("offers no depth_mode \"") + name + '"', "\"raw\" is always there");
}

freenect_frame_mode KinectDevice::set_video(freenect_video_format format, const char* name) {
  for (int i = 0; i < api_.get_video_mode_count(); ++i) {
    const freenect_frame_mode mode = api_.get_video_mode(i);
    if (mode.is_valid == 0 || mode.resolution != FREENECT_RESOLUTION_MEDIUM || mode.video_format != format) continue;
    if (api_.set_video_mode(device_, mode) < 0) fail(std::string("does not take pixel_format \"") + name + '"');
    return mode;
  }
  fail(std::string("offers no pixel_format \"") + name + '"', "\"rgb\" is always there");
}

bool KinectDevice::process(DurationNs timeout_ns) {
  constexpr int kInterrupted = -10;  // LIBUSB_ERROR_INTERRUPTED: a signal, nothing else
  listening = &log_;
  timeval timeout{timeout_ns / kSecond, timeout_ns % kSecond / kMicrosecond};
  const int result = api_.process_events_timeout(context_, &timeout);
  listening = nullptr;
  return result >= 0 || result == kInterrupted;
}

void KinectDevice::fail(const std::string& why, const std::string& remedy) const {
  throw CameraError(serial_.empty() ? "kinect" : "kinect " + serial_,
                    log_.last_error.empty() ? why : why + " (" + log_.last_error + ")", remedy);
}

}  // namespace wasp::drivers
